"""Making of data sets: the same bytes with any workers and after any interruption."""

import hashlib
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest

import mapquilt
from mapquilt.dataset import group
from mapquilt.dataset.carried_plans import carry_plans
from mapquilt.dataset.manifest import read_manifest
from mapquilt.dataset.plan import plan_dataset
from mapquilt.dataset.spec import READY, DatasetSpec, load_spec, ready_spec
from mapquilt.jobs.journal import job_folder
from mapquilt.json_file import read_record
from tests.conftest import command, hashes
from tests.mapquilt.cli.test_app import heed_interrupts, refused
from tests.mapquilt.dataset.test_verify import reseal


def reseal_files(folder):
    """Let the manifest hold the hashes of the files of its samples."""
    lines = [json.loads(line) for line in (folder / "manifest.jsonl").read_text().splitlines()]
    for record in lines:
        if record["kind"] == "sample":
            for path in record["files"]:
                data = (folder / "samples" / record["sample"] / path).read_bytes()
                record["files"][path] = hashlib.sha256(data).hexdigest()
    (folder / "manifest.jsonl").write_text("".join(json.dumps(record) + "\n" for record in lines))


def make(spec, out, workers=1):
    return [
        sys.executable,
        "-m",
        "mapquilt",
        "dataset",
        "make",
        str(spec),
        "--out",
        str(out),
        "--workers",
        str(workers),
    ]


def test_two_workers_make_the_same_bytes(tiny, spec_file, tmp_path):
    subprocess.run(make(spec_file, tmp_path / "two", 2), check=True)
    assert hashes(tmp_path / "two") == hashes(tiny)


def test_making_a_finished_data_set_again_changes_nothing(tiny, spec_file, tmp_path):
    copy = shutil.copytree(tiny, tmp_path / "copy")
    stamps = {path: path.stat().st_mtime_ns for path in copy.rglob("*")}
    assert command("dataset", "make", spec_file, "--out", copy) == 0
    assert {path: path.stat().st_mtime_ns for path in copy.rglob("*")} == stamps


def test_a_data_set_killed_at_twenty_random_instants_ends_the_same_to_the_byte(tiny, spec_file, tmp_path):
    """Each attempt is killed, with its workers' pipes open, somewhere between its start and its end."""
    instants = random.Random(20)
    start = time.monotonic()
    subprocess.run(make(spec_file, tmp_path / "whole"), check=True)
    whole = time.monotonic() - start
    out = tmp_path / "killed"
    for _ in range(20):
        process = subprocess.Popen(make(spec_file, out))
        try:
            process.wait(timeout=instants.uniform(0.3, 1.0) * whole)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        else:
            assert process.returncode == 0
            assert hashes(out) == hashes(tiny)
            shutil.rmtree(out)
    subprocess.run(make(spec_file, out), check=True)
    assert hashes(out) == hashes(tiny)


def test_a_truncated_journal_and_lost_samples_end_the_same(tiny, spec_file, tmp_path):
    """After a kill or a lost write, the journal may be truncated anywhere, and folders may be missing."""
    manifest = read_manifest(tiny)
    lines = [
        {
            "task": str(index),
            "records": [record for record in (*manifest.missions, *manifest.samples) if record["mission"] == name],
            "failures": [],
        }
        for index, name in enumerate(mission["mission"] for mission in manifest.missions)
    ]
    journal = "".join(json.dumps(line) + "\n" for line in lines).encode()
    for cut in (0, 10, len(journal) // 2, len(journal) - 1, len(journal)):
        out = shutil.copytree(tiny, tmp_path / str(cut))
        (out / "manifest.jsonl").unlink()
        (out / ".journal.jsonl").write_bytes(journal[:cut])
        shutil.rmtree(out / "samples/000002")
        (out / "samples/000003/maps.json").write_bytes(b"")
        (out / "samples/000004/maps.json").write_text("{}")
        (out / "samples/.000005.0.part").mkdir()
        assert command("dataset", "make", spec_file, "--out", out) == 0
        assert hashes(out) == hashes(tiny)


def test_an_interrupt_says_how_to_continue(spec_file, tmp_path):
    process = subprocess.Popen(
        make(spec_file, tmp_path / "data", 2),
        stderr=subprocess.PIPE,
        start_new_session=True,
        preexec_fn=heed_interrupts,
    )
    while not (tmp_path / "data/.lock").exists():
        time.sleep(0.1)
    time.sleep(1.0)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert b"continues" in errors
    assert b"Traceback" not in errors


def test_a_sample_is_made_again_alone_bit_for_bit(tiny, tmp_path):
    assert command("dataset", "remake", tiny, "000003", "--out", tmp_path / "again") == 0
    assert hashes(tmp_path / "again/samples/000003") == hashes(tiny / "samples/000003")


def test_another_specification_or_a_foreign_folder_is_refused(tiny, spec_file, tmp_path, capsys):
    other = tmp_path / "other.yaml"
    other.write_text(spec_file.read_text().replace("seed: 5", "seed: 6"))
    assert "other settings" in refused(capsys, "dataset", "make", other, "--out", tiny)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/thesis.tex").touch()
    assert "not empty" in refused(capsys, "dataset", "make", other, "--out", tmp_path / "mine")


def test_two_processes_in_one_folder_are_refused(spec_file, tmp_path, capsys):
    out = tmp_path / "data"
    process = subprocess.Popen(make(spec_file, out))
    while not (out / ".lock").exists():
        time.sleep(0.05)
    time.sleep(0.2)
    line = refused(capsys, "dataset", "make", spec_file, "--out", out)
    assert "another mapquilt" in line
    assert process.wait(timeout=120) == 0


def test_the_lock_dies_with_its_holder(tmp_path):
    hold = "import sys, time; from pathlib import Path; from mapquilt.jobs.journal import job_folder\n"
    hold += "with job_folder(Path(sys.argv[1]), 'job', 'mark', ''): print('held', flush=True); time.sleep(600)"

    def held() -> AbstractContextManager[None]:
        return job_folder(tmp_path, "job", "mark", "")

    process = subprocess.Popen([sys.executable, "-c", hold, str(tmp_path)], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"held\n"
    with pytest.raises(ValueError, match="another mapquilt"), held():
        pass
    process.kill()
    process.communicate()
    with held(), pytest.raises(ValueError, match="another mapquilt"), held():
        pass


def test_a_full_disk_damages_nothing(tiny, spec_file, tmp_path):
    limited = f"ulimit -f 60; exec {' '.join(make(spec_file, tmp_path / 'data'))}"
    done = subprocess.run(["bash", "-c", limited], check=False, capture_output=True, text=True)
    assert done.returncode == 2, done.stderr
    (line,) = done.stderr.splitlines()
    assert re.fullmatch(r"mapquilt: /\S+: File too large", line)
    assert command("dataset", "make", spec_file, "--out", tmp_path / "data") == 0
    assert hashes(tmp_path / "data") == hashes(tiny)


def test_a_failing_sample_is_recorded_and_the_others_are_made(tmp_path):
    spec = tmp_path / "spec.yaml"
    spec.write_text(
        "name: some-fail\nmissions:\n"
        "  - {world: office, count: 1, robots: 1, duration: 1}\n"
        "  - {world: office, count: 1, robots: 1, duration: 2}\n"
        "samples: {per_mission: 2, parts: [1, 20]}\n"
    )
    assert command("dataset", "make", spec, "--out", tmp_path / "data", "--workers", 1) == 1
    failures = [json.loads(line) for line in (tmp_path / "data/failures.jsonl").read_text().splitlines()]
    manifest = read_manifest(tmp_path / "data")
    assert len(failures) == 1
    assert "20" in failures[0]["reason"]
    assert len(manifest.samples) == 3


def test_a_merge_in_a_sample_is_not_reported_by_verify(tiny, tmp_path, capsys):
    copy = tmp_path / "copy"
    shutil.copytree(tiny, copy)
    sample = sorted((copy / "samples").iterdir())[0]
    assert command("merge", sample) in (0, 1)
    assert command("score", sample) == 0
    assert (sample / "overview.png").exists()
    assert command("dataset", "verify", copy) == 0
    shutil.copy(sample / "merge.json", copy / "missions" / "merge.json")
    assert command("dataset", "verify", copy) == 1
    assert "missions/merge.json: is in no record" in capsys.readouterr().out


def test_verify_finds_changed_files(tiny, tmp_path, capsys):
    copy = shutil.copytree(tiny, tmp_path / "copy")
    assert command("dataset", "verify", copy) == 0
    (copy / "samples/000000/robot_0/map.pgm").unlink()
    (copy / "samples/000001/truth.json").write_text("{}")
    (copy / "samples/000001/note.txt").touch()
    capsys.readouterr()
    assert command("dataset", "verify", copy) == 1
    printed = capsys.readouterr().out
    for text in ("robot_0/map.pgm: is missing", "truth.json: has changed", "note.txt: is in no record"):
        assert text in printed


def test_the_manifest_names_no_time_host_or_path(tiny):
    text = (tiny / "manifest.jsonl").read_text() + (tiny / "spec.json").read_text() + (tiny / "README.md").read_text()
    assert str(tiny) not in text
    assert os.uname().nodename not in text
    assert not any(path.name == "timings.json" for path in tiny.rglob("*"))


def test_samples_are_runs_for_every_command(tiny, tmp_path):
    copy = shutil.copytree(tiny, tmp_path / "copy")
    sample = copy / "samples/000001"
    assert command("merge", sample) in (0, 1)
    assert command("score", sample) == 0
    assert (sample / "overview.png").exists()


def test_every_seed_is_a_function_of_the_root_and_the_number():
    spec = load_spec("standard")
    plan = plan_dataset(spec)
    seeds = [sample.settings.seed for mission in plan.missions for sample in mission.samples]
    assert len(set(seeds)) == len(seeds)
    assert len({mission.seed for mission in plan.missions}) == len(plan.missions)
    assert plan_dataset(spec) == plan
    other = plan_dataset(spec.model_copy(update={"seed": spec.seed + 1}))
    assert not {mission.seed for mission in other.missions} & {mission.seed for mission in plan.missions}


@pytest.mark.parametrize("name", READY)
def test_ready_specifications_are_balanced_and_commented(name):
    spec = load_spec(name)
    assert ready_spec(name).startswith("#")
    plan = plan_dataset(spec)
    levels = [sample.settings.sensing.noise for mission in plan.missions for sample in mission.samples]
    counts = [levels.count(level) for level in spec.samples.noise]
    assert max(counts) - min(counts) <= 0.15 * max(counts) + 1  # the mixture has fewer samples than combinations
    splits = [mission.split for mission in plan.missions]
    for split, share in spec.splits.items():
        assert splits.count(split) / len(splits) == pytest.approx(share / sum(spec.splits.values()), abs=0.11)


def test_negatives_are_of_two_worlds_in_one_split():
    plan = plan_dataset(load_spec("standard"))
    mission_of = {sample.name: mission for mission in plan.missions for sample in mission.samples}
    assert len(set(plan.negatives)) == 250
    for pair in plan.negatives:
        target, source = mission_of[pair.target[0]], mission_of[pair.source[0]]
        assert target.index != source.index
        assert target.split == source.split == pair.split


def test_alike_worlds_are_of_one_family_or_building_in_one_split_and_differ():
    carried = carry_plans(load_spec("hard"))
    plan = plan_dataset(carried.spec, carried.worlds)
    mission_of = {sample.name: mission for mission in plan.missions for sample in mission.samples}
    ends = [(mission_of[pair.target[0]], mission_of[pair.source[0]]) for pair in plan.negatives]
    any_two, alike = ends[:20], ends[20:]
    assert len(set(plan.negatives)) == 140
    assert all(target.fingerprint != source.fingerprint for target, source in ends)
    assert all(target.missions.kind == source.missions.kind for target, source in alike)
    assert any(target.missions.kind != source.missions.kind for target, source in any_two)
    storeys = [target.missions.kind for target, source in alike if target.missions.world != source.missions.world]
    assert set(storeys) == {"college", "clinic"}


def test_samples_by_the_particle_filter_are_planned_beside_those_by_slam():
    spec = {"name": "both", "missions": [{"world": "office", "count": 1}], "samples": {"poses": ["slam", "particle"]}}
    (mission,) = plan_dataset(DatasetSpec.model_validate(spec)).missions
    mappings = [sample.settings.mapping for sample in mission.samples]
    assert {(each.mapper, each.poses) for each in mappings} == {("log-odds", "slam"), ("particle", "slam")}


def test_more_negative_pairs_than_there_are_is_refused():
    spec = {"name": "few", "missions": [{"world": "office", "count": 2, "robots": 1}], "splits": {"test": 1}}
    samples = {"per_mission": 1}
    for key in ("other_worlds", "alike_worlds"):
        assert len(plan_dataset(DatasetSpec.model_validate(spec | {"samples": samples, key: 2})).negatives) == 2
        with pytest.raises(ValueError, match=rf"{key} is 3, but there are hardly more than 2 different pairs"):
            plan_dataset(DatasetSpec.model_validate(spec | {"samples": samples, key: 3}))
    spec["missions"] = [{"world": "office", "count": 1}, {"world": "house", "count": 1}]
    with pytest.raises(ValueError, match="alike_worlds needs a split with two different worlds of one family"):
        plan_dataset(DatasetSpec.model_validate(spec | {"alike_worlds": 1}))


def test_missions_in_one_world_share_a_split_and_make_no_negative():
    """The hall is the same at every seed, and so is a plan, by whatever name; only offices differ."""
    missions = [
        {"world": "thesis_hall", "count": 3},
        {"world": "office", "count": 4},
        {"world": "thesis_hall", "count": 2},
    ]
    spec = DatasetSpec.model_validate({"name": "halls", "missions": missions, "other_worlds": 60})
    plan = plan_dataset(spec)
    hall = [mission for mission in plan.missions if mission.missions.world == "thesis_hall"]
    assert len({mission.fingerprint for mission in plan.missions}) == 5
    assert {mission.split for mission in hall} == {"train"}
    mission_of = {sample.name: mission for mission in plan.missions for sample in mission.samples}
    for pair in plan.negatives:
        target, source = mission_of[pair.target[0]], mission_of[pair.source[0]]
        assert target.fingerprint != source.fingerprint
        assert target.split == source.split == pair.split


def test_negatives_of_one_world_alone_are_refused(capsys, tmp_path):
    spec = tmp_path / "halls.yaml"
    spec.write_text("name: halls\nmissions:\n  - {world: thesis_hall, count: 3}\nother_worlds: 1\n")
    assert "at least two different worlds" in refused(capsys, "dataset", "make", spec, "--out", tmp_path / "data")
    assert not (tmp_path / "data").exists()


@pytest.mark.parametrize(
    ("missions", "says"),
    [
        ("{world: moon, count: 1}", "missions.1.world: is moon, must be a file or one of office"),
        ("{world: plan.png, count: 1}", "needs --plan-resolution"),
    ],
)
def test_a_world_that_cannot_be_opened_is_refused_before_the_first_mission(
    capsys, tmp_path, monkeypatch, missions, says
):
    monkeypatch.chdir(tmp_path)
    spec = tmp_path / "spec.yaml"
    spec.write_text(f"name: some\nmissions:\n  - {{world: office, count: 1}}\n  - {missions}\n")
    assert says in refused(capsys, "dataset", "make", spec, "--out", tmp_path / "data")
    assert not (tmp_path / "data").exists()


def test_verify_names_worlds_in_two_splits_and_negatives_of_one_world(tiny, tmp_path, capsys):
    """Two missions of the data set are made to be in one world, as older data sets of a floor plan are."""
    copy = Path(shutil.copytree(tiny, tmp_path / "copy"))
    manifest = read_manifest(copy)
    splits = {record["mission"]: record["split"] for record in manifest.missions}
    (leaked,) = (name for name, split in splits.items() if split == "test")
    world = (copy / "missions/00000/world.json").read_bytes()
    for name in splits:
        (copy / "missions" / name / "world.json").write_bytes(world)
    lines = (copy / "manifest.jsonl").read_text()
    for record in manifest.missions:
        lines = lines.replace(record["files"]["world.json"], hashlib.sha256(world).hexdigest())
    (copy / "manifest.jsonl").write_text(lines)
    reseal(copy)
    capsys.readouterr()
    assert command("dataset", "verify", copy) == 1
    printed = capsys.readouterr().out
    assert f"missions/{leaked}: is in the world of missions/" in printed
    assert printed.count("are of one world, although the manifest calls them a negative pair") == 2


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("seed: 5", "seed: -5"), ("seed", "-5")),
        (("count: 3", "count: 0"), ("missions.0.count", "0")),
        (("noise: [0, 1]", "noise: [nan]"), ("samples.noise", "nan")),
        (("noise: [0, 1]", "noise: []"), ("noise",)),
        (("noise: [0, 1]", "parts: [0]"), ("parts", "0")),
        (("noise: [0, 1]", "magic: 1"), ("samples.magic",)),
        (("other_worlds: 2", "other_worlds: many"), ("other_worlds", "many")),
        (("name: tiny", "name: ../evil"), ("name",)),
        (("splits: {train: 0.67, test: 0.33}", "splits: {}"), ("splits",)),
        (("missions:", "missions: ["), ("YAML",)),
    ],
)
def test_bad_specifications_name_the_field_and_the_value(capsys, spec_file, tmp_path, change, expected):
    bad = tmp_path / "bad.yaml"
    bad.write_text(spec_file.read_text().replace(*change))
    line = refused(capsys, "dataset", "make", bad, "--out", tmp_path / "data")
    assert all(text in line for text in ("bad.yaml", *expected)), line
    assert not (tmp_path / "data").exists()


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (("--split", "tets"), "has no split 'tets', only test, train; did you mean test?"),
        (("--world", "maz"), "has no world 'maz', only "),
        (("--noise", 7), "has no noise 7, only 0, 1"),
    ],
)
def test_a_list_of_pairs_of_a_stratum_that_is_not_there_is_refused(capsys, tiny, option, message):
    assert message in refused(capsys, "dataset", "pairs", tiny, *option)


def test_init_writes_a_specification_that_loads(tmp_path, capsys):
    path = tmp_path / "mine.yaml"
    assert command("dataset", "init", path, "--from", "standard") == 0
    assert load_spec(str(path)) == load_spec("standard")
    capsys.readouterr()
    assert "exists" in refused(capsys, "dataset", "init", path)


def test_the_loader_gives_typed_lazy_samples_and_pairs(tiny):
    data = mapquilt.load_dataset(tiny)
    train, test = (mapquilt.load_dataset(tiny, split=split) for split in ("train", "test"))
    assert len(data.samples) == len(train.samples) + len(test.samples) == 6
    assert len(data.pairs) == len(train.pairs) + len(test.pairs)
    assert sum(pair.target_from_source is None for pair in data.pairs) == 2
    pair = next(pair for pair in data.pairs if pair.target_from_source is not None)
    truth = data.samples[0].truth()
    assert (
        pair.target_from_source
        == truth.pairs[pair.target_path.parent.name, pair.source_path.parent.name].target_from_source
    )
    assert pair.residual == truth.pairs[pair.target_path.parent.name, pair.source_path.parent.name].residual
    assert pair.target_scale == truth.robot(pair.target_path.parent.name).truth.world_from_map.scale
    settings = data.samples[0].record["settings"]
    assert (pair.world, pair.noise, pair.poses) == ("office", settings["noise"], settings["poses"])
    assert np.array_equal(pair.target.log_odds, data.samples[0].maps().grids[0].log_odds)
    assert len(pair.map_set()) == 2
    assert not pair.map_set().resolutions_trusted


def test_a_data_set_of_the_first_schemas_is_read_with_the_new_names(tiny, tmp_path):
    new_names = {
        "disguise": "frame_perturbation",
        "true_agreement": "true_score",
        "rival_agreement": "second_best_score",
    }
    old = tmp_path / "old"
    shutil.copytree(tiny, old)
    for file in (old / "manifest.jsonl", *old.glob("samples/*/run.json"), *old.glob("samples/*/truth.json")):
        text = re.sub('(mapquilt-(manifest|run|truth))/2"', '\\1/1"', file.read_text())
        for before, after in new_names.items():
            text = text.replace(f'"{after}"', f'"{before}"')
        assert text != file.read_text()
        file.write_text(text)
    with pytest.raises(ValueError, match=r"manifest.jsonl: has changed since the data set was made"):
        read_manifest(old)
    (old / "SHA256SUMS").unlink()  # which such a data set does not have
    assert read_manifest(old) == read_manifest(tiny)
    sample = "samples/000000"
    for kind in ("run", "truth"):
        assert read_record(old / sample / f"{kind}.json", kind) == read_record(tiny / sample / f"{kind}.json", kind)
    reseal_files(old)
    assert mapquilt.load_dataset(old).samples[0].truth() == mapquilt.load_dataset(tiny).samples[0].truth()


def test_a_torch_style_dataset_needs_five_lines(tiny):
    class Pairs:
        def __init__(self, folder, split):
            self.pairs = mapquilt.load_dataset(folder, split).pairs

        def __len__(self):
            return len(self.pairs)

        def __getitem__(self, index):
            pair = self.pairs[index]
            return pair.target.occupancy(), pair.source.occupancy(), pair.target_from_source

    pairs = Pairs(tiny, "train")
    assert len(pairs) > 4
    assert pairs[0][0].dtype == np.int8


def test_an_unknown_split_lists_the_known_ones(tiny):
    with pytest.raises(ValueError, match="test, train"):
        mapquilt.load_dataset(tiny, "exam")


def test_pairs_are_listed_by_stratum(tiny, capsys):
    assert command("dataset", "pairs", tiny, "--noise", 0, "--split", "train") == 0
    printed = capsys.readouterr().out
    assert " test " not in printed
    assert "pairs" in printed
    assert "--overlap" in refused(capsys, "dataset", "pairs", tiny, "--overlap", "0.6:0.3")


def test_pairs_are_of_different_robots(tiny):
    for sample in read_manifest(tiny).samples:
        robot = {one["name"]: one["robot"] for one in sample["maps"]}
        assert all(robot[pair["target"]] != robot[pair["source"]] for pair in sample["pairs"])
        assert len(sample["pairs"]) == sample["settings"]["parts"] ** 2


def test_groups_depend_on_their_plan_alone():
    plan = plan_dataset(load_spec("smoke")).missions[0]
    short = plan.__class__(
        plan.index,
        plan.missions.model_copy(update={"duration": 2.0}),
        plan.seed,
        plan.fingerprint,
        plan.split,
        plan.samples,
    )
    with ThreadPoolExecutor(1) as pool:
        elsewhere = pool.submit(group.make_group, short).result()
    assert elsewhere == group.make_group(short)


def test_reading_a_data_set_loads_neither_simulator_nor_worlds_nor_merger(tiny):
    program = (
        "import sys, mapquilt; mapquilt.load_dataset(sys.argv[1]).pairs[0].target_from_source; "
        "sys.exit(','.join({'sim', 'worlds', 'merge', 'pydantic'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program, str(tiny)], capture_output=True, text=True)
    assert (done.stderr, done.returncode) == ("\n", 1)
