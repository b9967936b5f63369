"""CARMEN logs, read back by a reader that follows the format's own field list."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.io.carmen import save_carmen
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory

STAMPS = [0.1, 0.2000000001, 17.0]
MOUNTING = SE2(0.2, -0.1, 0.5)


@pytest.fixture
def log() -> RobotLog:
    rng = np.random.default_rng(5)
    ranges = rng.uniform(0.2, 12.0, (3, 7)).astype(np.float32)
    ranges[0, 2], ranges[1, 3], ranges[2, 0] = np.inf, -np.inf, 12.0
    scans = [LidarScan(stamp, -2.0, 0.7, 0.1, 12.0, row) for stamp, row in zip(STAMPS, ranges, strict=True)]
    return RobotLog(tuple(scans), Trajectory(STAMPS, rng.normal(size=(3, 3))), MOUNTING)


def read(path: Path) -> list[dict[str, object]]:
    entries: list[dict[str, object]] = []
    for line in path.read_text().splitlines():
        name, *words = line.split()
        if name == "TRUEPOS":
            numbers = [float(word) for word in words[:7]]
            entries.append({"kind": name, "true": numbers[:3], "odom": numbers[3:6], "stamp": numbers[6]})
        elif name == "ROBOTLASER1":
            count = int(words[7])
            after = 8 + count + 1 + int(words[8 + count])
            assert len(words) == after + 14
            entries.append(
                {
                    "kind": name,
                    "sensor": [float(word) for word in words[1:5]],
                    "ranges": np.array(words[8 : 8 + count], dtype=np.float32),
                    "laser": [float(word) for word in words[after : after + 3]],
                    "odom": [float(word) for word in words[after + 3 : after + 6]],
                    "stamp": float(words[after + 11]),
                }
            )
        else:
            assert name == "#"
    return entries


def test_scans_and_odometry_are_read_back_to_the_last_bit(tmp_path: Path, log: RobotLog) -> None:
    save_carmen(tmp_path / "log.carmen", log)
    entries = read(tmp_path / "log.carmen")
    assert [entry["kind"] for entry in entries] == ["ROBOTLASER1"] * 3
    for index, (entry, scan) in enumerate(zip(entries, log.scans, strict=True)):
        returned = entry["ranges"][scan.returned]  # type: ignore[index]
        np.testing.assert_array_equal(returned, scan.ranges[scan.returned])
        np.testing.assert_array_equal(entry["odom"], log.odometry.poses[index])
        assert entry["stamp"] == scan.stamp
        assert entry["sensor"] == pytest.approx([-2.0, 4.2, 0.7, 12.0])


def test_no_return_reads_beyond_the_maximum_and_too_close_reads_zero(tmp_path: Path, log: RobotLog) -> None:
    save_carmen(tmp_path / "log.carmen", log)
    far, near, farthest = (entry["ranges"] for entry in read(tmp_path / "log.carmen"))
    assert far[2] > 12.0  # type: ignore[index]
    assert near[3] == 0.0  # type: ignore[index]
    assert farthest[0] == 12.0  # type: ignore[index]


def test_the_laser_pose_includes_the_mounting(tmp_path: Path) -> None:
    scan = LidarScan(0.0, 0.0, 0.1, 0.1, 12.0, [1.0])
    quarter = Trajectory([0.0], [[3.0, 4.0, math.pi / 2.0]])
    save_carmen(tmp_path / "log.carmen", RobotLog((scan,), quarter, MOUNTING))
    (entry,) = read(tmp_path / "log.carmen")
    assert entry["laser"] == pytest.approx([3.1, 4.2, math.pi / 2.0 + 0.5])


def test_a_truepos_line_precedes_each_scan(tmp_path: Path, log: RobotLog) -> None:
    truth = Trajectory(STAMPS, [[1.0, 2.0, 3.0], [4.0, 5.0, -1.0], [7.0, 8.0, 0.5]])
    save_carmen(tmp_path / "log.carmen", log, truth)
    entries = read(tmp_path / "log.carmen")
    assert [entry["kind"] for entry in entries] == ["TRUEPOS", "ROBOTLASER1"] * 3
    for index, entry in enumerate(entries[::2]):
        assert entry["true"] == truth.poses[index].tolist()
        assert entry["odom"] == log.odometry.poses[index].tolist()
        assert entry["stamp"] == STAMPS[index]


def test_a_truth_of_another_mission_is_refused(tmp_path: Path, log: RobotLog) -> None:
    with pytest.raises(ValueError, match="different stamps"):
        save_carmen(tmp_path / "log.carmen", log, Trajectory([0.0], [[0.0, 0.0, 0.0]]))
    assert not list(tmp_path.iterdir())
