"""Output of `mapquilt merge`: all files or none, and never over foreign files."""

from __future__ import annotations

import json
import resource
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from mapping.io.map_file import save_map
from mapping.io.transaction import LEDGER_FILE
from mapquilt.merging.merge_folder import merge_run
from mapquilt.runs.stages import sense_run
from mapquilt.settings import SampleSettings
from merge.settings import MergeSettings
from tests.conftest import command, hashes
from tests.mapquilt.cli.test_app import office_map, refused


@pytest.fixture
def two_maps(tmp_path: Path) -> tuple[Path, Path]:
    (tmp_path / "maps").mkdir()
    for name in ("a", "b"):
        save_map(office_map(), tmp_path / "maps" / name)
    return tmp_path / "maps/a.yaml", tmp_path / "maps/b.yaml"


def small_disk() -> None:
    """Let no file grow beyond what the merged map and merge.json need, so that a picture cannot be written."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))


@pytest.mark.parametrize("stage", ["merge", "score"])
def test_a_stage_that_cannot_write_all_changes_nothing(fresh_run: Path, stage: str) -> None:
    assert (fresh_run / "merge.png").stat().st_size > 20_000 > (fresh_run / "merge.json").stat().st_size
    before = hashes(fresh_run, but=())
    call = [sys.executable, "-m", "mapquilt", stage, str(fresh_run)]
    done = subprocess.run(call, preexec_fn=small_disk, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "File too large" in done.stderr
    assert hashes(fresh_run, but=()) == before


def test_a_new_merge_deletes_the_score_of_the_old_one(fresh_run: Path) -> None:
    but = ("timings.json", LEDGER_FILE)
    before = hashes(fresh_run, but=(*but, "score.json", "overview.png"))
    assert command("merge", fresh_run) in (0, 1)
    assert hashes(fresh_run, but=but) == before
    assert {"simulate", "sense", "merge", "score"} < set(json.loads((fresh_run / "timings.json").read_text()))


def test_a_merge_is_not_written_into_a_replaced_run(fresh_run: Path, merged_run: Path) -> None:
    def replace(_done: int, _total: int) -> None:
        sense_run(merged_run, fresh_run, SampleSettings(seed=99))

    with pytest.raises(ValueError, match="was replaced by another run"):
        merge_run(fresh_run, MergeSettings("orb"), 0, replace)
    assert not (fresh_run / "merge.json").exists()


@pytest.mark.parametrize(
    "text", ["null", "[]", "3", "{}", '{"unit": "s", "merge": 3}', '{"unit": "s", "merge": {"a": "b"}}']
)
@pytest.mark.parametrize("stage", ["merge", "score"])
def test_damaged_timings_are_reported_before_the_merge(fresh_run: Path, capsys, text: str, stage: str) -> None:
    (fresh_run / "timings.json").write_text(text)
    before = hashes(fresh_run, but=())
    assert f"{fresh_run / 'timings.json'}: " in refused(capsys, stage, fresh_run)
    assert hashes(fresh_run, but=()) == before


def test_a_run_without_timings_can_be_merged(fresh_run: Path) -> None:
    (fresh_run / "timings.json").unlink()
    assert command("merge", fresh_run) in (0, 1)
    assert set(json.loads((fresh_run / "timings.json").read_text())) == {"unit", "merge"}


def test_an_older_merge_is_replaced(two_maps: tuple[Path, Path], tmp_path: Path) -> None:
    out = tmp_path / "merged"
    assert command("merge", *two_maps, "--out", out) == 0
    first = hashes(out)
    (out / "note.txt").touch()
    assert command("merge", *two_maps, "--seed", 1, "--out", out) == 0
    assert set(hashes(out)) == {*first, "note.txt"}
    assert json.loads((out / "merge.json").read_text())["seed"] == 1


@pytest.mark.parametrize("link", [False, True])
def test_a_merge_never_replaces_its_inputs(two_maps: tuple[Path, Path], tmp_path: Path, capsys, link: bool) -> None:
    out = tmp_path / "merged"
    assert command("merge", *two_maps, "--out", out) == 0
    capsys.readouterr()
    before = hashes(tmp_path)
    named = out
    if link:
        named = tmp_path / "link"
        named.symlink_to(out)
    for source in ("merged.yaml", "merged.pgm"):
        assert "would overwrite" in refused(capsys, "merge", out / source, two_maps[1], "--out", named)
    assert {path: each for path, each in hashes(tmp_path).items() if "link" not in path} == before


def test_a_merge_never_replaces_a_run_or_foreign_files(
    two_maps: tuple[Path, Path], fresh_run: Path, tmp_path: Path, capsys
) -> None:
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis/merged.pgm").write_text("years of work")
    before = hashes(tmp_path, but=())
    assert f"{fresh_run}: is a run" in refused(capsys, "merge", *two_maps, "--out", fresh_run)
    for folder in (fresh_run / "robot_0", tmp_path / "thesis"):
        assert f"{folder}: is not empty and holds no merge.json of mapquilt" in refused(
            capsys, "merge", *two_maps, "--out", folder
        )
    assert "exists and is not a folder" in refused(capsys, "merge", *two_maps, "--out", two_maps[0])
    assert hashes(tmp_path, but=()) == before


@pytest.mark.parametrize("verb", ["merge", "sense", "simulate"])
def test_nothing_is_written_inside_another_run_or_merge(
    two_maps: tuple[Path, Path], fresh_run: Path, tmp_path: Path, capsys, verb: str
) -> None:
    assert command("merge", *two_maps, "--out", tmp_path / "merged") == 0
    (tmp_path / "link").symlink_to(fresh_run)
    capsys.readouterr()
    what = {"merge": two_maps, "sense": (fresh_run,), "simulate": ("office", "--duration", 2)}[verb]
    before = hashes(tmp_path, but=())
    for around, kind in ((fresh_run, "run"), (tmp_path / "link", "run"), (tmp_path / "merged", "merge")):
        for out in (around / "new", around / "new/deeper"):
            line = refused(capsys, verb, *what, "--out", out)
            assert line == f"mapquilt: {out}: lies inside the {kind} {around.resolve()}; name a folder outside it"
    assert hashes(tmp_path, but=()) == before


def test_a_foreign_file_with_the_name_of_a_record_makes_no_run(two_maps: tuple[Path, Path], tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text('{"their": "own"}')
    assert command("merge", *two_maps, "--out", tmp_path / "merged") == 0


@pytest.mark.parametrize("verb", ["merge", "sense", "simulate"])
def test_an_empty_folder_name_is_refused(
    two_maps: tuple[Path, Path], merged_run: Path, tmp_path: Path, capsys, monkeypatch, verb: str
) -> None:
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    what = {"merge": two_maps, "sense": (merged_run,), "simulate": ("office",)}[verb]
    assert "--out" in refused(capsys, verb, *what, "--out", "")
    assert list((tmp_path / "empty").iterdir()) == []
