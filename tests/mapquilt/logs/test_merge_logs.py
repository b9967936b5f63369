"""``mapquilt merge`` of logs: the same answer as mapping first, and refusals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mapping.io.carmen import save_carmen
from mapping.io.robot_log_file import load_robot_log, save_robot_log
from mapping.robot.recorded_log import RecordedLog
from mapping.settings import MappingSettings
from mapquilt.logs.load_log import NamedLog
from mapquilt.logs.log_files import log_name, unique_names
from mapquilt.logs.log_map import draw_log
from mapquilt.merging.joint_maps import _linked, draw_jointly
from merge.settings import MergeSettings
from merge.verification.settings import AcceptanceSettings
from tests.conftest import command
from tests.mapping.slam.rooms import along, log_of, office, ring_corridor
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
    copy = logs[0].with_name("copy.log")
    copy.write_bytes(logs[0].read_bytes())
    assert command("merge", logs[0], copy) == 2
    assert "are one log; a map is not merged with itself" in capsys.readouterr().err
    assert command("merge", logs[0].parent, "--add", logs[0]) == 2
    assert "first.log: is a log, must be a map; draw it first: mapquilt map LOG --out DIR" in capsys.readouterr().err
    assert command("merge", logs[0], logs[0].with_name("none.bag")) == 2
    assert "none.bag: no such file" in capsys.readouterr().err


@pytest.fixture(scope="module")
def office_logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two robots that drive one room on different ways."""
    folder = tmp_path_factory.mktemp("logs")
    ways = [(0, 0), (4, 1.5), (6, 4), (3.5, 2.5)], [(6.5, 4.5), (1, 2.5), (0, 4), (0, 0), (4, 0)]
    for number, way in enumerate(ways):
        poses = along(np.array(way, float), speed=0.1)
        log, _ = log_of(office(), poses, noise=0.02, odometry_noise=2.0, seed=number, beams=180)
        (folder / f"robot_{number}").mkdir()
        save_robot_log(folder / f"robot_{number}" / "log.npz", log)
    return folder / "robot_0" / "log.npz", folder / "robot_1" / "log.npz"


def test_an_elastic_merge_optimises_the_poses_of_logs_together(
    office_logs: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The maps are drawn anew; the record and the note name the robots after the folders of their logs."""
    assert command("merge", *office_logs, "--elastic", "--out", tmp_path / "out") == 0
    assert "robot_0 and robot_1: poses optimised together, by " in " ".join(capsys.readouterr().out.split())
    assert command("merge", *office_logs, "--out", tmp_path / "alone") == 0
    records = [json.loads((tmp_path / name / "merge.json").read_text()) for name in ("out", "alone")]
    assert [one["name"] for one in records[0]["maps"]] == ["robot_0", "robot_1"]
    assert records[0]["maps"][1]["fingerprint"] != records[1]["maps"][1]["fingerprint"]
    assert command("merge", *office_logs, "--elastic", "--out", tmp_path / "again") == 0
    assert (tmp_path / "again" / "merged.pgm").read_bytes() == (tmp_path / "out" / "merged.pgm").read_bytes()


def test_robots_whose_maps_do_not_join_keep_their_maps(office_logs: tuple[Path, Path]) -> None:
    logs = [NamedLog(path.parent.name, RecordedLog(load_robot_log(path).part(0, 30)), path) for path in office_logs]
    refusing = MergeSettings(acceptance=AcceptanceSettings(min_confidence=1.0))
    joint = draw_jointly(logs, MappingSettings(), refusing)
    assert joint.loops == {}
    for log in logs:
        alone = draw_log(log, MappingSettings()).grid
        assert joint.grids[log.name].log_odds.tobytes() == alone.log_odds.tobytes()


def test_robots_that_no_loop_links_keep_their_maps() -> None:
    """A room and a corridor, stitched as if both robots had started at one place."""
    logs = []
    for number, (walls, way) in enumerate(((office(), [(0, 0), (4, 1.5)]), (ring_corridor(), [(15, 14), (15, 4)]))):
        log, _ = log_of(walls, along(np.array(way, float), speed=0.1), noise=0.02, seed=number, beams=180)
        logs.append(NamedLog(f"robot_{number}", RecordedLog(log), Path(f"robot_{number}")))
    joint = draw_jointly(logs, MappingSettings(), MergeSettings(trust_priors=True))
    assert joint.loops == {}
    for log in logs:
        alone = draw_log(log, MappingSettings()).grid
        assert joint.grids[log.name].log_odds.tobytes() == alone.log_odds.tobytes()


@pytest.mark.parametrize(
    ("pairs", "linked"),
    [((), {0}), (((0, 1),), {0, 1}), (((1, 2), (0, 2)), {0, 1, 2}), (((1, 2), (0, 3)), {0, 3})],
)
def test_loops_link_robots_over_others(pairs: tuple[tuple[int, int], ...], linked: set[int]) -> None:
    assert _linked(dict.fromkeys(pairs, 1)) == linked


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("acapulco-corrected.log.gz", "acapulco_corrected"),
        ("2011-03.bag", "log_2011_03"),
        ("Flur ü.mcap", "Flur"),
        ("run/robot_3/log.npz", "robot_3"),
    ],
)
def test_robots_are_named_after_files(file: str, name: str) -> None:
    assert log_name(Path(file)) == name


def test_names_that_come_again_are_numbered() -> None:
    assert unique_names(["a", "b", "a", "a_1", "a"]) == ("a", "b", "a_1", "a_1_1", "a_2")
