"""Adversity of a whole team: off by default, the same for all robots, exact and marked in each scan."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.robot.robot_log import RobotTruth
from mapping.robot.trajectory import Trajectory
from mapping.seeds import Role, stream
from sim.mission.mission import Mission
from sim.sensors.adversity.glass import glaze
from sim.sensors.adversity.movables import Movables
from sim.sensors.adversity.people import People
from sim.sensors.adversity.ramps import Ramps
from sim.sensors.adversity.settings import AMOUNTS, LEVEL_ONE, Adversity
from sim.sensors.adversity.surroundings import Surroundings, adverse_scans, draw_surroundings
from sim.sensors.lidar import Lidar
from sim.sensors.noise import Noise
from sim.sensors.sensing import SensedLog, sense
from sim.sensors.settings import SensingSettings
from worlds.world import World

STREAMS = {
    "people": Role.PEOPLE,
    "doors": Role.DOORS,
    "objects": Role.MOVED_OBJECTS,
    "glass": Role.GLASS,
    "ramps": Role.RAMPS,
}
MUCH = {"people": 10.0, "doors": 1.0, "objects": 10.0, "glass": 0.5, "ramps": 20.0}
LIDAR = Lidar()


def ranges(scans) -> np.ndarray:
    return np.array([scan.ranges for scan in scans])


def surroundings(mission: Mission, adversity: Adversity, seed: int = 4) -> Surroundings | None:
    return draw_surroundings(mission.world, [truth.trajectory for truth in mission.robots], adversity, seed)


def sensed(mission: Mission, noise: Noise, robot: int = 0, seed: int = 4) -> SensedLog:
    return sense(mission.robots[robot], noise, seed, robot, surroundings(mission, noise.adversity, seed))


def test_no_level_of_noise_has_adversity(mission: Mission) -> None:
    for level in (0.0, 1.0, 20.0):
        assert Noise.level(level).adversity == Adversity()
    assert all(getattr(Adversity(), name) == 0.0 < getattr(LEVEL_ONE, name) for name in AMOUNTS)
    assert surroundings(mission, Adversity()) is None
    assert surroundings(mission, Adversity(slip=1.0, latency=1.0, jitter=1.0)) is None


def test_nothing_adverse_around_changes_nothing(mission: Mission) -> None:
    rare = surroundings(mission, Adversity(glass=1e-9))
    assert rare is not None
    for truth in mission.robots:
        scans, changed = adverse_scans(truth, rare)
        assert ranges(scans).tobytes() == ranges(truth.scans).tobytes()
        assert not changed.any()


@pytest.mark.parametrize("name", MUCH)
def test_each_adversity_changes_scans_alone_and_marks_what_it_changed(name: str, mission: Mission) -> None:
    adverse = Noise(adversity=Adversity(**{name: MUCH[name]}))
    base, changed = sensed(mission, Noise()), sensed(mission, adverse)
    other = ranges(base.log.scans) != ranges(changed.log.scans)
    assert other.any()
    assert np.array_equal(base.log.odometry.poses, changed.log.odometry.poses)
    if name != "ramps":  # a tilted beam on a wall is longer and no outlier
        assert not (other & ~changed.outliers).any()
    assert not (base.outliers & ~changed.outliers & np.isfinite(ranges(changed.log.scans)) & ~other).any()
    assert ranges(sensed(mission, adverse).log.scans).tobytes() == ranges(changed.log.scans).tobytes()
    assert not np.array_equal(ranges(sensed(mission, adverse, seed=5).log.scans), ranges(changed.log.scans))


@pytest.mark.parametrize("name", ["people", "doors", "objects"])
def test_things_in_the_way_only_shorten_beams_and_more_of_them_more(name: str, mission: Mission) -> None:
    true = ranges(mission.robots[0].scans)
    before = true
    for share in (0.1, 0.4, 1.0):
        around = surroundings(mission, Adversity(**{name: share * MUCH[name]}))
        assert around is not None
        scans, changed = adverse_scans(mission.robots[0], around)
        assert (ranges(scans) <= before).all()
        assert np.array_equal(changed, ranges(scans) != true)
        before = ranges(scans)
    assert (before < true).any()


@pytest.mark.parametrize("name", STREAMS)
def test_each_adversity_uses_only_its_own_stream(name: str, mission: Mission, monkeypatch: pytest.MonkeyPatch) -> None:
    adversity = Adversity(**{name: MUCH[name]})

    def with_streams_moved(moved: set[Role]) -> np.ndarray:
        for module in ("people", "movables", "glass", "ramps"):
            monkeypatch.setattr(
                f"sim.sensors.adversity.{module}.stream",
                lambda seed, role, index=0: stream(seed + (role in moved), role, index),
            )
        around = surroundings(mission, adversity)
        assert around is not None
        return ranges(adverse_scans(mission.robots[0], around)[0])

    base = with_streams_moved(set())
    assert np.array_equal(base, with_streams_moved(set(Role) - {STREAMS[name]}))
    assert not np.array_equal(base, with_streams_moved({STREAMS[name]}))


def test_all_adversities_leave_each_other_alone(mission: Mission) -> None:
    whole, people, doors = (
        surroundings(mission, each) for each in (LEVEL_ONE, Adversity(people=LEVEL_ONE.people), Adversity(doors=0.3))
    )
    assert whole is not None and people is not None and doors is not None
    assert np.array_equal(whole.people.places, people.people.places)
    rows = {tuple(row) for row in whole.movables.segments.reshape(-1, 4)}
    assert {tuple(row) for row in doors.movables.segments.reshape(-1, 4)} < rows


def standing(*poses: tuple[float, float, float]) -> list[RobotTruth]:
    """Robots that stand in a wide empty field with one scan, without a return."""
    return [
        RobotTruth(
            (LIDAR.scan(0.0, np.full(LIDAR.beams, np.inf)),),
            Trajectory(np.zeros(1), np.array([pose])),
            np.zeros((1, LIDAR.beams), dtype=bool),
            SE2(0.1, 0.0, 0.2),
        )
        for pose in poses
    ]


def around_a_field(people: np.ndarray, movables: Movables | None = None, ramps: Ramps | None = None) -> Surroundings:
    field = World("field", 0, (40.0, 40.0), ())
    return Surroundings(
        people=People(people, 0.22),
        movables=movables or Movables(np.empty((0, 2, 2)), np.empty((0, 2))),
        glass=glaze(field, Adversity(), 0),
        ramps=ramps or Ramps(np.empty((0, 2)), np.empty(0), 1.0),
        adversity=Adversity(),
    )


def test_two_robots_see_a_person_at_the_same_place() -> None:
    place = np.array((20.0, 21.0))
    around = around_a_field(np.tile(place, (2, 1, 1)))
    for truth in standing((17.0, 20.0, 0.3), (20.0, 25.0, -2.0)):
        scans, changed = adverse_scans(truth, around)
        lidar = truth.trajectory.pose(0) @ truth.base_from_lidar
        hits = lidar.apply(scans[0].points())
        assert len(hits) == changed.sum() > 2
        assert np.hypot(*(hits - place).T) == pytest.approx(0.22, abs=1e-5)


def test_a_door_stands_from_its_first_moment_to_before_its_last() -> None:
    door = Movables(np.array([[(22.0, 18.0), (22.0, 22.0)]]), np.array([(0.0, 5.0)]))
    seen = [
        adverse_scans(truth, around_a_field(np.empty((2, 0, 2)), door))[1].any()
        for truth in standing((20.0, 20.0, 0.0))
    ]
    assert seen == [True]
    assert [len(door.at(time)) for time in (0.0, 4.99, 5.0)] == [1, 1, 0]


def test_a_ramp_shows_the_floor_downhill_and_marks_it() -> None:
    ramps = Ramps(np.array([(20.0, 20.0)]), np.array([math.pi / 2.0]), 1.0)
    (truth,) = standing((20.0, 20.0, 1.0))
    (scan,), changed = adverse_scans(truth, around_a_field(np.empty((2, 0, 2)), ramps=ramps))
    # Straight downhill, at 12 : 1, the floor is 0.18 / sin(atan(1 / 12)) away: hardly farther than the level 2.16 m.
    assert scan.ranges.min() == pytest.approx(0.18 * math.hypot(12.0, 1.0), rel=1e-3)
    lidar = truth.trajectory.pose(0) @ truth.base_from_lidar
    assert (lidar.apply(scan.points())[:, 1] < lidar.y).all()
    assert np.array_equal(changed[0], scan.returned)


def test_sensing_without_the_surroundings_is_refused(mission: Mission) -> None:
    with pytest.raises(ValueError, match="there are no surroundings"):
        sense(mission.robots[0], Noise(adversity=LEVEL_ONE), 1, 0)


def test_a_level_multiplies_amounts_and_leaves_properties() -> None:
    double = LEVEL_ONE.scaled(2.0)
    for each in fields(Adversity):
        factor = 2.0 if each.name in AMOUNTS else 1.0
        assert getattr(double, each.name) == pytest.approx(factor * getattr(LEVEL_ONE, each.name))
    assert LEVEL_ONE.scaled(0.0) == Adversity()
    assert LEVEL_ONE.scaled(20.0).doors == 1.0


@pytest.mark.parametrize("name", [each.name for each in fields(Adversity)])
def test_bad_values_are_refused_by_name_and_value(name: str) -> None:
    for value in (-1.0, math.nan, 1e9):
        with pytest.raises(ValueError, match=f"Adversity: {name} is {value}, must lie between 0 and "):
            replace(Adversity(), **{name: value})
    with pytest.raises(ValueError, match=f"Adversity: {name} is -1.0"):
        SensingSettings(components=((f"adversity.{name}", -1.0),))


def test_properties_that_must_be_positive_refuse_zero() -> None:
    with pytest.raises(ValueError, match=r"Adversity: pane_width is 0\.0, must be positive"):
        Adversity(pane_width=0.0)
    with pytest.raises(ValueError, match=r"Adversity: doors is 1\.5, must lie between 0 and 1$"):
        Adversity(doors=1.5)
