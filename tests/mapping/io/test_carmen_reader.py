"""CARMEN logs: round trips with the writer, known answers of hand-written lines, refusals."""

from __future__ import annotations

import gzip
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.io.carmen import save_carmen
from mapping.io.carmen_reader import load_carmen
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory

MOUNTING = SE2(0.2, -0.1, 0.5)


def made_up_log() -> tuple[RobotLog, Trajectory]:
    rng = np.random.default_rng(5)
    stamps = [0.1, 0.2000000001, 17.0]
    ranges = rng.uniform(0.2, 11.9, (3, 7)).astype(np.float32)
    ranges[0, 2], ranges[1, 3] = np.inf, -np.inf
    scans = [LidarScan(stamp, -2.0, 0.7, 0.0, 12.0, row) for stamp, row in zip(stamps, ranges, strict=True)]
    log = RobotLog(tuple(scans), Trajectory(stamps, rng.normal(size=(3, 3))), MOUNTING)
    return log, Trajectory(stamps, rng.normal(size=(3, 3)))


def flaser(
    stamp: float, pose: tuple[float, ...], odometry: tuple[float, ...], beams: int = 4, reading: float = 2
) -> str:
    numbers = (*(reading,) * beams, *pose, *odometry)
    return f"FLASER {beams} {' '.join(map(str, numbers))} {stamp} host {stamp}"


def odom(stamp: float, *pose: float) -> str:
    return f"ODOM {' '.join(map(str, pose))} 0 0 0 {stamp} host {stamp}"


def written(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "hand.log"
    path.write_text("\n".join(["# CARMEN Logfile", *lines, ""]))
    return path


@pytest.mark.parametrize("compressed", [False, True])
def test_a_written_log_is_read_back(tmp_path: Path, compressed: bool) -> None:
    log, truth = made_up_log()
    path = tmp_path / "log.carmen"
    save_carmen(path, log, truth)
    if compressed:
        path.write_bytes(gzip.compress(path.read_bytes()))
    read = load_carmen(path)
    assert read.reference is not None
    assert read.warnings == ()
    assert read.has_odometry
    np.testing.assert_array_equal(read.log.odometry.stamps, log.odometry.stamps)
    np.testing.assert_array_equal(read.log.odometry.poses, log.odometry.poses)
    np.testing.assert_allclose(np.exp(1j * read.reference.poses), np.exp(1j * truth.poses), atol=1e-12)
    for mine, theirs in zip(read.log.scans, log.scans, strict=True):
        np.testing.assert_array_equal(mine.ranges, theirs.ranges)
        assert (mine.angle_min, mine.angle_increment, mine.range_max) == (-2.0, 0.7, 12.0)
    found = read.log.base_from_lidar
    np.testing.assert_allclose((found.x, found.y, found.yaw), (0.2, -0.1, 0.5), atol=1e-6)


@pytest.mark.parametrize(
    ("beams", "step", "last"), [(180, 1.0, 89.0), (181, 1.0, 90.0), (360, 0.5, 89.5), (361, 0.5, 90.0)]
)
def test_beams_of_an_old_message_are_a_half_turn(tmp_path: Path, beams: int, step: float, last: float) -> None:
    read = load_carmen(written(tmp_path, flaser(1.0, (0, 0, 0), (0, 0, 0), beams)))
    angles = np.degrees(read.log.scans[0].angles)
    np.testing.assert_allclose((angles[0], angles[1] - angles[0], angles[-1]), (-90.0, step, last))


def test_an_offset_of_the_laser_is_the_mounting_and_no_reference(tmp_path: Path) -> None:
    poses = [(1.0, 2.0, 0.3), (2.0, 2.5, 2.9), (1.5, 3.0, -3.0)]
    offset = SE2(0.15, 0.02, 0.0)
    lines = []
    for stamp, pose in enumerate(poses):
        lidar = SE2(*pose) @ offset
        lines.append(flaser(stamp, (lidar.x, lidar.y, lidar.yaw), pose))
    read = load_carmen(written(tmp_path, *lines))
    assert read.reference is None
    assert read.log.base_from_lidar == offset
    np.testing.assert_allclose(read.log.odometry.poses, poses)


def test_poses_that_move_against_the_odometry_are_the_reference(tmp_path: Path) -> None:
    corrected = [(0.3, 0.0, 0.0), (1.3, 0.1, math.pi / 2.0)]
    bases = [(0.0, 0.0, 0.0), (1.1, 0.0, 1.5)]
    lines = [flaser(k, pose, base) for k, (pose, base) in enumerate(zip(corrected, bases, strict=True))]
    read = load_carmen(written(tmp_path, "PARAM robot_frontlaser_offset 0.3 host 0", *lines))
    assert read.reference is not None
    np.testing.assert_allclose(read.log.odometry.poses, bases)
    np.testing.assert_allclose(read.reference.poses, [(0.0, 0.0, 0.0), (1.3, -0.2, math.pi / 2.0)], atol=1e-12)


def test_odometry_that_restarts_at_corrected_poses_is_composed(tmp_path: Path) -> None:
    """gmapping corrects 1 m of driving by 0.1 m twice; the odometry itself goes 1 m, turns left, and goes 1 m."""
    quarter = math.pi / 2.0
    lines = [
        odom(0.5, 0, 0, 0),
        flaser(0.5, (0, 0, 0), (0, 0, 0)),
        odom(0, 0, 0, 0),
        odom(1.0, 1, 0, quarter),
        flaser(1.0, (1.1, 0, quarter), (1.1, 0, quarter)),
        odom(0, 1.1, 0, quarter),
        odom(1.5, 1.1, 0.6, quarter),
        odom(2.0, 1.1, 1.0, quarter),
        flaser(2.0, (1.2, 1.0, quarter), (1.2, 1.0, quarter)),
    ]
    read = load_carmen(written(tmp_path, *lines))
    assert read.reference is not None
    np.testing.assert_allclose(read.log.odometry.poses, [(0, 0, 0), (1, 0, quarter), (1, 1, quarter)], atol=1e-12)
    np.testing.assert_allclose(read.reference.poses, [(0, 0, 0), (1.1, 0, quarter), (1.2, 1, quarter)])


def test_raw_scans_take_interpolated_odometry(tmp_path: Path) -> None:
    raw = "RAWLASER1 0 -0.5 1.0 0.5 10.0 0.01 0 3 1 10.0 0 1 77 {0} host {0}"
    lines = [raw.format(0.5), odom(1.0, 0, 0, 3.0), raw.format(1.5), odom(2.0, 1, 2, -3.0), raw.format(2.5)]
    read = load_carmen(written(tmp_path, "PARAM robot_frontlaser_offset 0.25 host 0", *lines))
    assert read.warnings == ("2 scans dropped, outside the time of the poses",)
    np.testing.assert_allclose(read.log.odometry.stamps, [1.5])
    np.testing.assert_allclose(read.log.odometry.poses, [(0.5, 1.0, math.pi)])
    assert read.log.base_from_lidar == SE2(0.25)
    np.testing.assert_array_equal(read.log.scans[0].ranges, np.float32([1.0, np.inf, -np.inf]))


def test_raw_scans_alone_have_no_odometry(tmp_path: Path) -> None:
    read = load_carmen(written(tmp_path, "RAWLASER1 0 -0.5 1.0 0.5 10.0 0.01 0 3 1 2 3 0 4.0 host 4.0"))
    assert not read.has_odometry
    np.testing.assert_array_equal(read.log.odometry.poses, [(0.0, 0.0, 0.0)])


def test_a_rear_laser_looks_backwards(tmp_path: Path) -> None:
    line = flaser(1.0, (0, 0, math.pi), (0, 0, 0)).replace("FLASER", "RLASER")
    mounting = load_carmen(written(tmp_path, line)).log.base_from_lidar
    assert (mounting.x, abs(mounting.yaw)) == pytest.approx((0.0, math.pi), abs=1e-5)


@pytest.mark.parametrize(
    ("longest", "reading", "lost"), [(30.0, 8.19, False), (30.0, 51.15, True), (8.19, 8.185, True)]
)
def test_error_codes_of_old_lidars_are_no_return(tmp_path: Path, longest: float, reading: float, lost: bool) -> None:
    lines = [flaser(0, (0, 0, 0), (0, 0, 0), reading=reading), flaser(1, (0, 0, 0), (0, 0, 0), reading=longest)]
    scan = load_carmen(written(tmp_path, *lines)).log.scans[0]
    assert bool(np.isposinf(scan.ranges).all()) is lost


def test_scans_that_go_back_in_time_or_change_their_beams_are_dropped_by_line(tmp_path: Path) -> None:
    stamps = [1.0, 2.0, 2.0, 1.5, 3.0]
    lines = [flaser(stamp, (stamp, 0, 0), (stamp, 0, 0)) for stamp in stamps]
    read = load_carmen(written(tmp_path, *lines, flaser(4.0, (0, 0, 0), (0, 0, 0), beams=5)))
    np.testing.assert_array_equal(read.log.odometry.stamps, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(read.log.odometry.poses[:, 0], [1.0, 2.0, 3.0])
    assert read.warnings == (
        "2 scans dropped, no later than the scan before; the first: line 4",
        "1 scan dropped, of 5 beams, not 4; the first: line 7",
    )


def test_a_fast_lidar_is_thinned_while_it_is_read(tmp_path: Path) -> None:
    lines = [flaser(k / 40.0, (k, 0, 0), (k, 0, 0)) for k in range(80)]
    read = load_carmen(written(tmp_path, *lines), max_rate=5.0)
    np.testing.assert_allclose(np.diff(read.log.odometry.stamps)[1:], 0.2)
    np.testing.assert_array_equal(read.log.odometry.poses[:, 0], read.log.odometry.stamps * 40.0)


def test_the_most_frequent_number_of_beams_is_kept(tmp_path: Path) -> None:
    lines = [flaser(k, (k, 0, 0), (k, 0, 0), beams=beams) for k, beams in enumerate((5, 4, 4, 5, 4))]
    read = load_carmen(written(tmp_path, *lines))
    np.testing.assert_array_equal(read.log.odometry.stamps, [1.0, 2.0, 4.0])
    assert read.warnings == ("2 scans dropped, of 5 beams, not 4; the first: line 2",)


def test_stamps_without_their_digits_are_replaced_by_numbers(tmp_path: Path) -> None:
    lines = [flaser(1018930000, (x, 0, 0), (x, 0, 0)) for x in range(5)]
    read = load_carmen(written(tmp_path, *lines))
    np.testing.assert_array_equal(read.log.odometry.stamps, np.arange(5.0))
    np.testing.assert_array_equal(read.log.odometry.poses[:, 0], np.arange(5.0))
    assert read.warnings == ("stamps do not increase at 4 of 5 scans: numbered 1 s apart",)


GOOD = flaser(1.0, (0, 0, 0), (0, 0, 0))


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("ODOM 0 0 0 0 0 0 1 host 1", "no scan: must have lines ROBOTLASER1"),
        (GOOD.rpartition(" ")[0], "line 2: FLASER: is cut off: must end in"),
        (GOOD.rpartition(" 2 ")[0], "line 2: FLASER: is cut off: 3 of 4 numbers"),
        (GOOD.replace("FLASER 4", "FLASER many"), "line 2: FLASER: 'many' is no number"),
        (GOOD.replace("FLASER 4", "FLASER 0"), "line 2: FLASER: number of readings is 0, must be"),
        (GOOD.replace("1.0 host", "nan host"), "line 2: FLASER: ipc_timestamp is nan, must be finite"),
        ("RAWLASER1 0 -3 7 1 10.0 0 0 9 1 1 1 1 1 1 1 1 1 0 1 host 1", "line 2: LidarScan: 9 beams"),
    ],
)
def test_a_damaged_log_is_refused_by_line(tmp_path: Path, line: str, message: str) -> None:
    path = written(tmp_path, line)
    with pytest.raises(ValueError, match=message) as refused:
        load_carmen(path)
    assert str(refused.value).startswith(f"{path}: ")


def test_a_cut_archive_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, *[GOOD] * 100)
    data = gzip.compress(path.read_bytes())
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(ValueError, match=r"hand\.log: damaged or cut off"):
        load_carmen(path)


WORDS = ("nan", "inf", "-1", "1e300", "1e12", "x", "0", "99999999999", "ODOM", "FLASER", "RAWLASER1", "")


@given(st.lists(st.tuples(st.integers(0, 999), st.integers(0, 99), st.sampled_from(WORDS)), min_size=1, max_size=4))
def test_a_damaged_word_is_read_or_refused_in_one_line(
    tmp_path_factory: pytest.TempPathFactory, damages: list[tuple[int, int, str]]
) -> None:
    lines = []
    for k in range(6):
        lines += [odom(k, k, 0, 0), flaser(k, (k + 0.1, 0, 0), (k + 0.1, 0, 0)), odom(0, k + 0.1, 0, 0)]
    for line, word, text in damages:
        words = lines[line % len(lines)].split(" ")
        words[word % len(words)] = text
        lines[line % len(lines)] = " ".join(words)
    path = written(tmp_path_factory.mktemp("damaged"), *lines)
    try:
        read = load_carmen(path)
    except ValueError as error:
        assert str(error).startswith(f"{path}: ")
        assert "\n" not in str(error)
    else:
        assert 1 <= len(read.log.scans) <= 6
