"""Robot logs on disk: exact round trips, the same bytes twice, and refusals that name the file."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.io.npz_file import save_npz
from mapping.io.robot_log_file import FIELDS, load_robot_log, save_robot_log
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory


def random_log(seed: int, scans: int, beams: int) -> RobotLog:
    """Scans whose limits and angles differ from sweep to sweep, some beams lost and some too close."""
    rng = np.random.default_rng(seed)
    stamps = rng.uniform(-1e6, 1.7e9) + np.cumsum(rng.uniform(0.01, 2.0, scans))
    sweeps = []
    for stamp in stamps:
        ranges = rng.uniform(0.5, 5.0, beams).astype(np.float32)
        ranges[rng.random(beams) < 0.2] = np.inf
        ranges[rng.random(beams) < 0.1] = -np.inf
        step = rng.uniform(0.01, 6.0 / beams) * rng.choice([-1.0, 1.0])
        sweeps.append(LidarScan(stamp, rng.normal(), step, rng.uniform(0, 0.4), rng.uniform(5.5, 80.0), ranges))
    poses = rng.normal(size=(scans, 3)) * 100.0
    return RobotLog(tuple(sweeps), Trajectory(stamps, poses), SE2(*rng.normal(size=3)), f"robot_{seed % 7}")


def assert_same(a: RobotLog, b: RobotLog) -> None:
    np.testing.assert_array_equal(a.odometry.stamps, b.odometry.stamps)
    np.testing.assert_array_equal(a.odometry.poses, b.odometry.poses)
    assert (a.base_from_lidar, a.robot) == (b.base_from_lidar, b.robot)
    for one, other in zip(a.scans, b.scans, strict=True):
        np.testing.assert_array_equal(one.ranges, other.ranges)
        for name in ("stamp", "angle_min", "angle_increment", "range_min", "range_max"):
            assert getattr(one, name) == getattr(other, name)


@settings(max_examples=60)
@given(st.integers(0, 2**32), st.integers(1, 12), st.integers(1, 40))
def test_a_log_round_trip_keeps_every_bit_and_byte(seed: int, scans: int, beams: int) -> None:
    log = random_log(seed, scans, beams)
    with tempfile.TemporaryDirectory() as folder:
        first, second = Path(folder) / "first.npz", Path(folder) / "second.npz"
        save_robot_log(first, log)
        again = load_robot_log(first)
        save_robot_log(second, again)
        assert first.read_bytes() == second.read_bytes()
    assert_same(again, log)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    save_robot_log(tmp_path / "log.npz", random_log(1, 5, 9))
    return tmp_path / "log.npz"


def refusal(path: Path) -> str:
    with pytest.raises(ValueError, match=r"\S") as caught:
        load_robot_log(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")


def test_a_truncated_log_is_refused_wherever_it_ends(path: Path) -> None:
    data = path.read_bytes()
    for size in range(0, len(data), 7):
        path.write_bytes(data[:size])
        assert refusal(path).startswith(("the file is empty", "not an .npz file", "damaged or of another kind ("))


@pytest.mark.slow
@settings(max_examples=200)
@given(st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), min_size=1, max_size=4))
def test_damaged_bytes_are_harmless_or_refused(edits: list[tuple[int, int]]) -> None:
    log = random_log(2, 4, 6)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.npz"
        save_robot_log(path, log)
        data = bytearray(path.read_bytes())
        for place, value in edits:
            data[place % len(data)] = value
        path.write_bytes(data)
        try:
            again = load_robot_log(path)
        except ValueError as error:
            assert str(error).startswith(f"{path}: ")
        else:
            assert_same(again, log)  # the archive's checksums cover the arrays: what is read is what was written


def test_a_file_of_another_kind_is_refused(path: Path) -> None:
    path.write_bytes(b"hello")
    assert refusal(path) == "not an .npz file"
    np.savez(path, stamps=np.zeros(3))
    assert "has no array 'odometry'" in refusal(path)
    np.savez(path, stamps=np.array([{"a": 1}], dtype=object))
    assert "pickle" in refusal(path)
    with pytest.raises(FileNotFoundError):
        load_robot_log(path.with_name("none.npz"))


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("ranges", lambda a: np.where(a == a[2, 3], np.nan, a), "scan 2: LidarScan: the range of beam 3 is NaN"),
        ("ranges", lambda a: a[:, :0], "needs (B,) with at least one beam"),
        ("ranges", lambda a: a[:-1], "the arrays do not have the same length"),
        ("ranges", lambda a: a[0], "ranges is of type float32 and shape (9,)"),
        ("ranges", lambda a: np.tile(a, 100), "exceed a turn"),
        ("ranges", lambda a: np.full_like(a, 1e4), "outside ["),
        ("stamps", lambda a: a[::-1], "does not come after"),
        ("stamps", lambda a: np.where(a == a[1], np.nan, a), "stamp is nan, not a finite number"),
        ("stamps", lambda a: a[None], "stamps is of type float64 and shape (1, 5)"),
        ("odometry", lambda a: np.where(a == a[1, 1], np.inf, a), "poses holds a number that is not finite"),
        ("odometry", lambda a: a[:, :2], "need (N,) and (N, 3)"),
        ("odometry", lambda a: a.astype(str), "odometry is of type <U"),
        ("base_from_lidar", lambda a: a * np.nan, "x is nan, not a finite number"),
        ("base_from_lidar", lambda a: a[:2], "base_from_lidar has shape (2,), must be (3,)"),
        ("angle_increment", lambda a: a * (np.arange(5) != 1), "scan 1: LidarScan: angle_increment is zero"),
        ("angle_increment", lambda a: a[:-1], "the arrays do not have the same length"),
        ("angle_min", lambda a: a * np.inf, "angle_min is"),
        ("range_max", lambda a: a * 0.0, "out of order"),
        ("robot", lambda a: a[None], "robot is of type <U7 and shape (1,)"),
        ("robot", lambda a: np.array(7), "robot is of type int64 and shape ()"),
    ],
)
def test_invalid_values_are_refused(path: Path, name: str, change, message: str) -> None:
    with np.load(path) as archive:
        fields = {field: archive[field] for field in FIELDS}
    fields["ranges"][2, 3] = 3.25
    save_npz(path, {**fields, name: change(fields[name])})
    assert message in refusal(path)
