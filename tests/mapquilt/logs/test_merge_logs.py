"""``mapquilt merge`` of logs: the same answer as mapping first, and refusals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mapping.io.carmen import save_carmen
from mapping.io.robot_log_file import save_robot_log
from mapquilt.logs.log_files import log_name, unique_names
from tests.conftest import command
from tests.mapquilt.logs.rooms import room_log


@pytest.fixture
def logs(tmp_path: Path) -> tuple[Path, Path]:
    """Two logs of one room, the second from half a circle on."""
    recorded = room_log()
    save_carmen(tmp_path / "first.log", recorded.select(np.arange(30)).log)
    save_robot_log(tmp_path / "second.npz", recorded.select(np.arange(30, 60)).log)
    return tmp_path / "first.log", tmp_path / "second.npz"


@pytest.mark.slow
def test_logs_are_mapped_and_merged(logs: tuple[Path, Path], tmp_path: Path) -> None:
    status = command("merge", *logs, "--out", tmp_path / "at_once")
    for log in logs:
        assert command("map", log, "--out", tmp_path / log.stem) == 0
    maps = [tmp_path / log.stem / "map.yaml" for log in logs]
    assert command("merge", *maps, "--out", tmp_path / "in_steps") == status
    at_once, in_steps = (json.loads((tmp_path / name / "merge.json").read_text()) for name in ("at_once", "in_steps"))
    assert [one["name"] for one in at_once["maps"]] == ["first", "second"]
    assert [one["fingerprint"] for one in at_once["maps"]] == [one["fingerprint"] for one in in_steps["maps"]]
    assert at_once["pairs"][0]["target_from_source"] == in_steps["pairs"][0]["target_from_source"]
    kept = tmp_path / "at_once" / "inputs" / "0" / "first.pgm"
    assert kept.read_bytes() == maps[0].with_suffix(".pgm").read_bytes()


def test_one_log_alone_or_twice_is_refused(logs: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    assert command("merge", logs[0]) == 2
    assert "first.log: gives one map; cut it with `mapquilt map --parts`" in capsys.readouterr().err
    assert command("merge", logs[0], logs[0]) == 2
    assert "are one log; a map is not merged with itself" in capsys.readouterr().err
    assert command("merge", logs[0], logs[0].with_name("none.bag")) == 2
    assert "none.bag: no such file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("file", "name"),
    [("acapulco-corrected.log.gz", "acapulco_corrected"), ("2011-03.bag", "log_2011_03"), ("Flur ü.mcap", "Flur")],
)
def test_robots_are_named_after_files(file: str, name: str) -> None:
    assert log_name(Path(file)) == name


def test_names_that_come_again_are_numbered() -> None:
    assert unique_names(["a", "b", "a", "a_1", "a"]) == ("a", "b", "a_1", "a_1_1", "a_2")
