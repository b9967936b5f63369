"""Missions: laws that hold for each, and reproducibility."""

from __future__ import annotations

import hashlib
import math
import subprocess
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.ground_truth.footprint import observed
from sim.mission.file import save_mission
from sim.mission.mission import Mission
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.physics.robot import RobotSettings
from sim.sensors.lidar import Lidar
from worlds.families.registry import make_world
from worlds.polygon import distances
from worlds.raster import true_raster
from worlds.world import World


def test_every_robot_scans_at_the_rate_from_zero_to_the_end(mission: Mission, short_settings: MissionSettings) -> None:
    assert len(mission.robots) == 3
    for truth in mission.robots:
        assert truth.trajectory.stamps.tolist() == [k / 10.0 for k in range(121)]
        assert truth.base_from_lidar == short_settings.robots[0].lidar.base_from_lidar


def test_robots_never_overlap_walls_or_each_other(mission: Mission) -> None:
    poses = np.array([truth.trajectory.poses for truth in mission.robots])
    assert mission.world.clearance(poses[..., :2].reshape(-1, 2)).min() >= 0.2 - 1e-3
    for a, b in combinations(poses, 2):
        assert np.hypot(*(a - b)[:, :2].T).min() >= 2.0 * 0.2 - 1e-3
    assert mission.contacts == (0, 0, 0)


def test_velocity_limits_hold_between_scans(mission: Mission) -> None:
    limits = mission.settings.robots[0].limits
    for truth in mission.robots:
        steps = np.diff(truth.trajectory.poses, axis=0)
        turns = np.remainder(steps[:, 2] + math.pi, math.tau) - math.pi
        assert np.hypot(steps[:, 0], steps[:, 1]).max() <= limits.speed * 0.1 + 1e-6
        assert np.abs(turns).max() <= limits.turn_rate * 0.1 + 1e-6


def test_robots_travel(mission: Mission) -> None:
    assert min(truth.trajectory.distance() for truth in mission.robots) > 0.4 * 0.6 * 12.0


def test_hits_end_on_walls_or_on_robots(mission: Mission) -> None:
    """Checks frames, mounting and flags: at each hit there is an obstacle or a robot."""
    poses = [truth.trajectory for truth in mission.robots]
    for index, truth in enumerate(mission.robots):
        for k in (0, 60, 120):
            scan = truth.scans[k]
            hits = (poses[index].pose(k) @ truth.base_from_lidar).apply(scan.points())
            on_robot = truth.hits_robot[k][scan.returned]
            assert np.quantile(distances(mission.world.segments(), hits[~on_robot]), 0.99) < 1e-3
            others = np.array([pose.poses[k, :2] for other, pose in enumerate(poses) if other != index])
            gaps = np.hypot(*(hits[on_robot][:, None] - others).transpose(2, 0, 1)).min(axis=1)
            assert np.allclose(gaps, 0.2, atol=0.01)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_in_another_process(mission: Mission, tmp_path: Path) -> None:
    program = """
import sys
from pathlib import Path
from mapping.geometry.se2 import SE2
from sim.sensors.lidar import Lidar
from sim.mission.simulation import simulate
from sim.mission.file import save_mission
from sim.mission.settings import MissionSettings
from sim.physics.robot import RobotSettings
from worlds.families.registry import make_world
settings = MissionSettings((RobotSettings(Lidar(base_from_lidar=SE2(0.08, -0.02, 0.4))),) * 3, duration=12.0)
save_mission(simulate(make_world("office", 1), settings, seed=5)[0], Path(sys.argv[1]))
"""
    subprocess.run([sys.executable, "-c", program, str(tmp_path / "other")], check=True, capture_output=True)
    save_mission(mission, tmp_path / "here")
    assert digests(tmp_path / "here") == digests(tmp_path / "other")
    assert len(digests(tmp_path / "here")) == 5


def digests(folder: Path) -> dict[str, str]:
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.iterdir())}


def test_another_seed_starts_elsewhere(mission: Mission) -> None:
    other, _ = simulate(mission.world, MissionSettings(duration=0.2), seed=6)
    for a, b in zip(mission.robots, other.robots, strict=True):
        assert math.dist(a.trajectory.poses[0, :2], b.trajectory.poses[0, :2]) > 0.1


def test_a_robot_sees_all_of_two_rooms_and_then_stands_still(two_rooms: World) -> None:
    mission, _ = simulate(two_rooms, MissionSettings(robots=1, duration=45.0), seed=1)
    truth = mission.robots[0]
    raster = true_raster(two_rooms)
    seen = observed(truth, raster.frame)
    assert (seen & raster.free).sum() > 0.97 * raster.free.sum()
    assert np.array_equal(truth.trajectory.poses[-1], truth.trajectory.poses[-20])
    assert len(truth.scans) == 451
    assert mission.contacts == (0,)


def test_progress_and_times_are_reported() -> None:
    reported: list[float] = []
    _, times = simulate(make_world("office", 1), MissionSettings(duration=0.5), 0, reported.append)
    assert reported == [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]
    parts = times.building + times.physics + times.rays + times.mapping + times.planning
    assert 0.5 * times.total < parts <= times.total


def test_an_odd_rate_keeps_exact_stamps() -> None:
    lidar = Lidar(beams=20, angle_increment=math.tau / 20, rate=7.0, base_from_lidar=SE2())
    mission, _ = simulate(make_world("office", 1), MissionSettings((RobotSettings(lidar),), duration=2.0), 0)
    assert mission.robots[0].trajectory.stamps.tolist() == [k / 7.0 for k in range(15)]


@pytest.mark.parametrize(
    ("field", "value"),
    [("robots", 0), ("robots", -1), ("duration", 0.0), ("duration", -5.0), ("duration", math.nan)],
)
def test_bad_settings_are_refused_by_name_and_value(field: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        MissionSettings(**{field: value})


def test_a_place_without_any_wall_is_explored_too() -> None:
    mission, _ = simulate(World("nothing", 0, (40.0, 40.0), ()), MissionSettings(robots=1, duration=5.0), 0)
    assert mission.robots[0].trajectory.distance() > 1.0
    assert not mission.robots[0].scans[0].returned.any()
