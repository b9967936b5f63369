"""Noise on a mission: exact at level 0, scaled by the level, with a random stream per component."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.robot.robot_log import RobotTruth
from mapping.robot.trajectory import Trajectory
from mapping.seeds import Role, stream
from sim.mission.mission import Mission
from sim.sensors.lidar import Lidar
from sim.sensors.lidar_presets import PRESETS
from sim.sensors.noise import COMPONENTS, Noise
from sim.sensors.range_noise import RangeNoise
from sim.sensors.sensing import SensedLog, sense

QUIET = Noise.level(0.0)


def standing(distance: float, scans: int = 300) -> RobotTruth:
    """A robot that stands still and reads the same distance with each of 360 beams."""
    stamps = np.arange(scans) / 10.0
    sweeps = tuple(Lidar().scan(stamp, np.full(360, distance)) for stamp in stamps)
    trajectory = Trajectory(stamps, np.tile((3.0, 4.0, 0.5), (scans, 1)))
    return RobotTruth(sweeps, trajectory, np.zeros((scans, 360), dtype=bool), SE2())


def ranges(sensed: SensedLog) -> np.ndarray:
    return np.array([scan.ranges for scan in sensed.log.scans])


def true_ranges(truth: RobotTruth) -> np.ndarray:
    return np.array([scan.ranges for scan in truth.scans])


@pytest.mark.parametrize("preset", PRESETS, ids=lambda preset: preset.name)
def test_at_level_zero_the_log_is_the_truth_bit_for_bit(mission: Mission, preset) -> None:
    for index, truth in enumerate(mission.robots):
        sensed = sense(truth, Noise.level(0.0, preset.noise), seed=3, robot_index=index)
        assert np.array_equal(ranges(sensed), true_ranges(truth))
        assert np.array_equal(sensed.log.odometry.poses, truth.trajectory.from_start().poses)
        assert np.array_equal(sensed.log.odometry.stamps, truth.trajectory.stamps)
        assert sensed.log.base_from_lidar == truth.base_from_lidar
        assert not sensed.outliers.any()


def test_errors_at_two_levels_differ_by_scale_alone(mission: Mission) -> None:
    truth = mission.robots[1]
    whole = [("lidar.dropout", 0.0), ("lidar.bias_sigma", 0.0)]
    one, three = (sense(truth, Noise.level(level).with_fields(whole), 4, 1) for level in (0.5, 1.5))
    true = true_ranges(truth).astype(float)
    both = np.isfinite(ranges(one)) & np.isfinite(ranges(three))
    errors = [ranges(each).astype(float)[both] - true[both] for each in (one, three)]
    assert np.allclose(3.0 * errors[0], errors[1], atol=1e-5)
    start = truth.trajectory.from_start().poses[:, 2]
    assert np.allclose(3.0 * (one.log.odometry.poses[:, 2] - start), three.log.odometry.poses[:, 2] - start)


ALL_ON = {
    "lidar.bias_sigma": 0.02,
    "lidar.bias_sigma_ratio": 0.01,
    "lidar.angle_sigma": 0.003,
    "lidar.quantum": 0.001,
    "lidar.short": 0.02,
    "lidar.random": 0.02,
    "adversity.slip": 1.0,
    "adversity.jitter": 0.1,
}
OTHER_VALUES = {
    "lidar.quantum": (0.07, 0.0),
    "lidar.short_mean": (0.4, 3.0),
    "adversity.latency": (0.5, 0.3),
    "adversity.slip": (5.0, 0.0),
    "adversity.slip_tail": (1.0, 9.0),
}
NO_AMOUNT = ("lidar.short_mean", "adversity.slip_size", "adversity.slip_tail")
DRAWS_OF = {
    "lidar.range_sigma": Role.RANGE_NOISE,
    "lidar.range_sigma_ratio": Role.RANGE_NOISE,
    "lidar.bias_sigma": Role.LIDAR_BIAS,
    "lidar.bias_sigma_ratio": Role.LIDAR_BIAS,
    "lidar.angle_sigma": Role.ANGULAR_JITTER,
    "lidar.quantum": None,
    "lidar.dropout": Role.DROPOUT,
    "lidar.short": Role.SHORT_READINGS,
    "lidar.short_mean": Role.SHORT_READINGS,
    "lidar.random": Role.RANDOM_READINGS,
    "odometry.alpha1": Role.ODOMETRY_NOISE,
    "odometry.alpha2": Role.ODOMETRY_NOISE,
    "odometry.alpha3": Role.ODOMETRY_NOISE,
    "odometry.alpha4": Role.ODOMETRY_NOISE,
    "odometry.radius_sigma": Role.ODOMETRY_BIAS,
    "odometry.track_sigma": Role.ODOMETRY_BIAS,
    "odometry.veer_sigma": Role.ODOMETRY_BIAS,
    "adversity.slip": Role.WHEEL_SLIP,
    "adversity.slip_size": Role.WHEEL_SLIP,
    "adversity.slip_tail": Role.WHEEL_SLIP,
    "adversity.latency": None,
    "adversity.jitter": Role.SCAN_DELAY,
}


class Recorder:
    """Hands out random streams and keeps all that was drawn from each."""

    def __init__(self) -> None:
        self.drawn: dict[Role, list[np.ndarray]] = {}
        self.opened: list[tuple[int, Role, int]] = []

    def __call__(self, seed: int, role: Role, index: int = 0) -> Recorded:
        self.opened.append((seed, role, index))
        return Recorded(stream(seed, role, index), self.drawn.setdefault(role, []))


class Recorded:
    def __init__(self, rng: np.random.Generator, drawn: list[np.ndarray]) -> None:
        self._rng, self._drawn = rng, drawn

    def __getattr__(self, name: str):
        def draw(*arguments):
            self._drawn.append(np.array(getattr(self._rng, name)(*arguments)))
            return self._drawn[-1]

        return draw


def recorded(monkeypatch: pytest.MonkeyPatch, truth: RobotTruth, noise: Noise) -> tuple[Recorder, SensedLog]:
    recorder = Recorder()
    monkeypatch.setattr("sim.sensors.sensing.stream", recorder)
    monkeypatch.setattr("sim.sensors.range_noise.stream", recorder)
    return recorder, sense(truth, noise, 7, 2)


def test_each_component_of_each_robot_has_its_own_stream(monkeypatch: pytest.MonkeyPatch) -> None:
    recorder, _ = recorded(monkeypatch, standing(3.0, scans=5), Noise())
    assert sorted(recorder.opened) == sorted((7, role, 2) for role in set(DRAWS_OF.values()) if role is not None)
    assert set(DRAWS_OF) < set(COMPONENTS)


@pytest.mark.parametrize("name", DRAWS_OF)
def test_no_draw_depends_on_any_level(name: str, mission: Mission, monkeypatch: pytest.MonkeyPatch) -> None:
    truth, usual = mission.robots[0], Noise().with_fields(ALL_ON.items())
    before, base = recorded(monkeypatch, truth, usual)
    for value in OTHER_VALUES.get(name, (0.5, 0.0)):
        after, sensed = recorded(monkeypatch, truth, usual.with_fields([(name, value)]))
        assert after.drawn.keys() == before.drawn.keys()
        for role, drawn in before.drawn.items():
            assert len(drawn) == len(after.drawn[role])
            assert all(np.array_equal(a, b) for a, b in zip(drawn, after.drawn[role], strict=True)), role
        moved = not np.array_equal(base.log.odometry.poses, sensed.log.odometry.poses)
        assert moved == name.startswith(("odometry.", "adversity."))
        assert np.array_equal(ranges(base), ranges(sensed)) == moved


@pytest.mark.parametrize("name", [name for name in DRAWS_OF if name not in NO_AMOUNT])
def test_a_component_uses_only_its_own_stream(name: str, mission: Mission, monkeypatch: pytest.MonkeyPatch) -> None:
    truth = mission.robots[0]
    noise = QUIET.with_fields([(name, OTHER_VALUES.get(name, (0.3,))[0])])

    def with_streams_moved(moved: set[Role]) -> SensedLog:
        for module in ("sim.sensors.sensing", "sim.sensors.range_noise"):
            monkeypatch.setattr(
                f"{module}.stream", lambda seed, role, index: stream(seed + (role in moved), role, index)
            )
        return sense(truth, noise, 7, 0)

    def same(a: SensedLog, b: SensedLog) -> bool:
        return np.array_equal(ranges(a), ranges(b)) and np.array_equal(a.log.odometry.poses, b.log.odometry.poses)

    roles = {role for role in DRAWS_OF.values() if role is not None}
    base = with_streams_moved(set())
    assert same(base, with_streams_moved(roles - {DRAWS_OF[name]}))
    if DRAWS_OF[name] is not None:
        assert not same(base, with_streams_moved({DRAWS_OF[name]}))


def test_robots_and_seeds_have_different_noise() -> None:
    truth = standing(3.0, scans=5)
    base, other_robot, other_seed = (sense(truth, Noise(), seed, robot) for seed, robot in ((1, 0), (1, 1), (2, 0)))
    assert np.array_equal(ranges(base), ranges(sense(truth, Noise(), 1, 0)))
    assert not np.array_equal(ranges(base), ranges(other_robot))
    assert not np.array_equal(ranges(base), ranges(other_seed))


def test_sensing_does_not_change_the_mission(mission: Mission) -> None:
    before = [true_ranges(truth).copy() for truth in mission.robots]
    sense(mission.robots[0], Noise.level(3.0), 1, 0)
    assert all(np.array_equal(a, true_ranges(truth)) for a, truth in zip(before, mission.robots, strict=True))


def test_level_one_is_the_default_and_levels_multiply() -> None:
    assert Noise.level(1.0) == Noise()
    assert Noise.level(2.0).lidar.range_sigma == 2.0 * Noise().lidar.range_sigma
    assert Noise.level(2.0).odometry.alpha3 == 2.0 * Noise().odometry.alpha3
    assert Noise.level(2.0).odometry.veer_sigma == 2.0 * Noise().odometry.veer_sigma
    assert RangeNoise().scaled(1000.0).dropout == 1.0


def test_a_component_is_set_by_its_name_and_nothing_else_changes() -> None:
    noise = Noise().with_fields([("lidar.range_sigma", 0.05), ("odometry.alpha1", 0.5), ("lidar.range_sigma", 0.07)])
    usual = Noise()
    expected = Noise(replace(usual.lidar, range_sigma=0.07), replace(usual.odometry, alpha1=0.5))
    assert noise == expected


def test_an_unknown_component_is_refused_with_the_known_ones() -> None:
    for name in ("lidar.sigma", "range_sigma", "lidar", "odometry.", "robot.alpha1"):
        with pytest.raises(ValueError, match=rf"noise component .{name}. is unknown; known are lidar\.range_sigma, "):
            Noise().with_fields([(name, 1.0)])


@pytest.mark.parametrize("level", [-0.1, math.nan, math.inf])
def test_bad_levels_are_refused(level: float) -> None:
    with pytest.raises(ValueError, match=f"noise is {level}"):
        Noise.level(level)
