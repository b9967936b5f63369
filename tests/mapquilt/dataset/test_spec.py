"""Keys of a specification: each is documented, its example is valid, and it reaches the plan."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from mapquilt.cli.exit_status import NOT_REACHED
from mapquilt.dataset.estimate import estimate
from mapquilt.dataset.plan import DatasetPlan, plan_dataset
from mapquilt.dataset.spec import SECTIONS, DatasetSpec, key_rows, load_spec
from mapquilt.leaves import leaf_names
from mapquilt.settings import ExperimentConfig
from tests.conftest import command
from tests.mapquilt.cli.test_app import refused

PAGE = (Path(__file__).parents[3] / "docs/datasets.md").read_text(encoding="utf-8")


def planned(missions: dict[str, Any] | None = None, samples: dict[str, Any] | None = None, **spec: Any) -> DatasetPlan:
    group = {"world": "maze", "count": 2, **(missions or {})}
    record = {"name": "tiny", "missions": [group], "samples": samples or {}, **spec}
    return plan_dataset(DatasetSpec.model_validate(record))


@pytest.mark.parametrize("section", SECTIONS)
def test_the_page_lists_every_key_as_the_schema_states_it(section: str) -> None:
    for name, about, unit, default, example in key_rows(section):
        assert f"| `{name}` | {about} | {unit or '-'} | {default} | `{example}` |" in PAGE
    title = f"### `{section}`" if section else "### Top level"
    table = PAGE.partition(title)[2].partition("\n#")[0]
    assert re.findall(r"^\| `(\w+)`", table, re.MULTILINE) == [row[0] for row in key_rows(section)]


@pytest.mark.parametrize(
    ("section", "key"), [(section, name) for section, model in SECTIONS.items() for name in model.model_fields]
)
def test_the_example_of_every_key_is_valid(section: str, key: str) -> None:
    field = SECTIONS[section].model_fields[key]
    assert field.description
    (example,) = field.examples or ()
    record: dict[str, Any] = {"name": "tiny", "missions": [{"world": "office", "count": 2}], "samples": {}}
    place = record if not section else record["samples"] if section == "samples" else record["missions"][0]
    place[key] = example
    DatasetSpec.model_validate(yaml.safe_load(yaml.safe_dump(record)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("missions:\n  - {world: office, count: 1, robot: 2}", "missions.0.robot: is no key; did you mean robots?"),
        ("missions:\n  - {world: office, count: 1, lidr: x}", "missions.0.lidr: is no key; did you mean lidar?"),
        ("missions:\n  - {world: office, count: 1, poses: [slam]}", "did you mean samples.poses?"),
        ("missions:\n  - {world: office, count: 1}\nsample: {}", "sample: is no key; did you mean samples?"),
        ("missions:\n  - {world: office, count: 1}\nsamples: {clear_rnge: 1}", "did you mean clear_range?"),
        ("missions:\n  - {world: office, count: 1}\nsamples: {xyz: 1}", "known are per_mission, noise, poses"),
    ],
)
def test_an_unknown_key_is_refused_with_the_nearest_known(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: str, message: str
) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(f"name: tiny\n{change}\n", encoding="utf-8")
    line = refused(capsys, "dataset", "make", path, "--out", tmp_path / "data")
    assert "bad.yaml" in line
    assert message in line


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "splits: {trian: 0.5, test: 0.5}",
            "splits: trian is no split, must be one of train, validation, test; did you",
        ),
        ("splits: {all: 1}", "splits: all is no split, must be one of train, validation, test"),
        ("splits: {train: 0.6, test: 0.5}", "splits: the shares add up to 1.1, must be 1"),
        ("splits: {train: 0.5}", "splits: the shares add up to 0.5, must be 1"),
        ("splits: {}", "splits: names no split; known are train, validation, test"),
        ("splits: {train: -1}", "splits.train: is -1, must be greater than 0"),
        ("samples: {per_mission: 2, parts: [0]}", "samples: parts is 0, must lie between 1 and 20"),
        ("samples: {per_mission: many}", "samples.per_mission: is many, must be a valid integer"),
        ("samples: 3", "samples: is 3, must be a valid dictionary"),
        ("seed: [1]", "seed: must be a valid integer, not a list"),
    ],
)
def test_a_bad_value_is_told_with_its_key_and_what_is_allowed(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(f"name: tiny\nmissions:\n  - {{world: maze, count: 1}}\n{text}\n", encoding="utf-8")
    with pytest.raises(ValueError) as refusal:
        load_spec(str(path))
    assert f"{path}: {message}" in str(refusal.value)
    assert "Value error" not in str(refusal.value)
    assert "it is {" not in str(refusal.value)


def test_shares_of_thirds_need_not_add_up_exactly() -> None:
    shares = {"train": 0.33, "validation": 0.33, "test": 0.33}
    assert {mission.split for mission in planned({"count": 3}, splits=shares).missions} == set(shares)


def test_an_unknown_world_is_told_with_the_file_the_key_and_the_nearest_name(tmp_path: Path) -> None:
    path = tmp_path / "typo.yaml"
    path.write_text("name: tiny\nmissions:\n  - {world: offce, count: 1}\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"typo\.yaml: missions\.0\.world: is offce, .*; did you mean office\?$"):
        load_spec(str(path))


def test_keys_of_missions_reach_their_settings() -> None:
    keys = {"starts": "spread", "drive": "wheels", "policy": "patrol", "rate": 5, "robots": 2, "duration": 7}
    (first, _) = planned(keys).missions
    settings = first.missions.settings()
    assert (settings.starts, settings.drive, settings.policy, settings.duration) == ("spread", "wheels", "patrol", 7.0)
    assert [robot.lidar.rate for robot in settings.robots] == [5.0, 5.0]


def test_listed_seeds_are_taken_in_turn() -> None:
    assert [mission.seed for mission in planned({"seeds": [40, 42]}).missions] == [40, 41]
    with pytest.raises(ValueError, match="seeds are 40 to 40, fewer than count, 2"):
        planned({"seeds": [40, 40]})


def test_missions_take_the_strata_of_overlap_in_turn() -> None:
    strata = [(0.0, 0.1), (0.3, 0.6)]
    plan = planned({"count": 5, "overlap_strata": strata})
    assert [mission.missions.settings().overlap for mission in plan.missions] == [*strata, *strata, strata[0]]
    with pytest.raises(ValueError, match="overlap and overlap_strata are both given"):
        planned({"overlap": [0, 1], "overlap_strata": strata})
    with pytest.raises(ValueError, match=r"overlap is 0\.6:0\.3"):
        planned({"overlap_strata": [[0.6, 0.3]]})


def test_keys_of_samples_reach_their_settings_in_every_combination() -> None:
    keys = {"per_mission": 4, "max_rotation": [180, 10], "max_offset": [0, 5], "clear_range": 8}
    samples = [sample.settings for sample in planned(samples=keys).missions[0].samples]
    drawn = {(round(math.degrees(one.perturbation.max_yaw)), one.perturbation.max_offset) for one in samples}
    assert drawn == {(180, 0.0), (180, 5.0), (10, 0.0), (10, 5.0)}
    assert {one.mapping.clear_range for one in samples} == {8.0}


def test_every_noise_component_is_a_key_of_set() -> None:
    names = [name for name in leaf_names(ExperimentConfig()) if name.startswith(("sensing.lidar", "sensing.odometry"))]
    assert len(names) > 10
    for name in names:
        (sample, *_) = planned(samples={"set": {name: [0.25]}}).missions[0].samples
        assert dict(sample.settings.sensing.components) == {name.removeprefix("sensing."): 0.25}


def test_the_clear_range_is_one_for_all_samples() -> None:
    for name in ("mapping.clear_range", "clear_range"):
        with pytest.raises(ValueError, match="use the key clear_range"):
            planned(samples={"set": {name: [0, 12]}})


def test_a_dry_run_counts_and_writes_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "data"
    assert command("dataset", "make", "smoke", "--out", out, "--dry-run", "--workers", 1) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "4 missions, 8 samples, 16 maps, 8 pairs, 3 pairs of two worlds" in printed
    assert re.search(r"about [\d.]+ (s|min) on 1 core, and [\d.]+ GB", printed)
    assert not out.exists()


def test_the_estimate_counts_what_the_plan_holds_and_grows_with_it() -> None:
    one, two = (estimate(plan_dataset(load_spec(name))) for name in ("smoke", "standard"))
    assert (two.missions, two.samples) == (72, 216)
    assert two.hours > 15 * one.hours
    assert two.gigabytes > 15 * one.gigabytes
    cut = estimate(planned({"overlap": [0.3, 0.5]}))
    assert cut.most_hours > cut.hours
    assert one.most_hours == one.hours


@pytest.mark.parametrize(
    "keys", ["count: 1000000000", "count: 1, robots: 10000000000000000000", "count: 1, robots: 30"]
)
def test_more_than_can_be_planned_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], keys: str) -> None:
    path = tmp_path / "huge.yaml"
    path.write_text(f"name: huge\nmissions:\n  - {{world: office, {keys}}}\n", encoding="utf-8")
    assert ", must be less than or equal to" in refused(capsys, "dataset", "make", path, "--out", tmp_path / "data")


def test_missions_that_miss_their_overlap_are_counted_with_a_status_of_their_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "far.yaml"
    group = "{world: disjoint, count: 1, robots: 2, duration: 1, starts: spread, overlap: [0.9, 1]}"
    path.write_text(
        f"name: far\nmissions:\n  - {group}\nsamples: {{per_mission: 1, poses: [truth]}}\nsplits: {{test: 1}}\n",
        encoding="utf-8",
    )
    for _ in range(2):
        assert command("dataset", "make", path, "--out", tmp_path / "data", "--workers", 1) == NOT_REACHED
        assert "1 mission did not reach the overlap" in capsys.readouterr().err
