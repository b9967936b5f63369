"""Simulated missions of a live merge: the maps of each robot as they grow, and their true places at any time."""

from __future__ import annotations

import bisect
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.log_odds import map_log
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.beam_endpoints import BeamEndpoints, beam_endpoints
from mapping.ground_truth.truth import MIN_COMMON_CELLS, common_rows, fit_rigid
from mapping.robot.robot_log import RobotTruth
from mapping.robot.trajectory import Trajectory
from mapping.seeds import Role, stream
from mapping.slam.pipeline import online_poses
from mapquilt.convert.ros_messages import BAG_START
from mapquilt.evaluation.transform_error import RIGHT, RIGHT_PLACE, TransformError, transform_error
from mapquilt.leaves import with_assignments
from mapquilt.live.bag_maps import map_message
from mapquilt.live.received_map import MapMessage
from mapquilt.live.simulated_team import team_messages
from mapquilt.runs.robot import RunRobot
from mapquilt.settings import COMBINED, ExperimentConfig, lidar_at_rate
from sim.mission.settings import MissionSettings, Starts
from sim.mission.simulation import simulate
from sim.physics.robot import RobotSettings
from sim.sensors.adversity.surroundings import draw_surroundings
from sim.sensors.sensing import SensedLog, sense
from worlds.families.registry import FAMILIES, make_world

SCANS_PER_SECOND = 5.0


@dataclass(frozen=True)
class MissionPlan:
    """Choose one mission: the families take turns with the ``seed``, the rest is drawn from it.

    ``duration`` [s]; ``noise`` and ``adversity`` are levels; robots start close to one another or anywhere. ``size``
    [m] is that of the world, None for the family's own.
    """

    seed: int
    family: str
    robots: int
    duration: float
    starts: Starts
    noise: float
    adversity: float
    size: tuple[float, float] | None = None

    @staticmethod
    def drawn(seed: int) -> MissionPlan:
        """Draw a mission of 2 to 4 robots and 30 to 50 s; every fourth has people, doors, glass, ramps and slip."""
        rng = stream(seed, Role.BENCHMARK_SAMPLE)
        return MissionPlan(
            seed=seed,
            family=tuple(FAMILIES)[seed % len(FAMILIES)],
            robots=int(rng.choice((2, 2, 2, 3, 3, 4))),
            duration=float(rng.choice((30.0, 40.0, 50.0))),
            starts="close" if rng.random() < 0.5 else "random",
            noise=float(rng.choice((0.0, 1.0, 1.0, 2.0))),
            adversity=float(rng.random() < 0.25),
        )


@dataclass(frozen=True, eq=False)
class MappedRobot:
    """Hold what a robot measured and where it was; ``drawn`` are the times [s] of its maps and the poses
    ``map_from_base`` (N, 3) of their scans, as SLAM had them then."""

    sensed: SensedLog
    truth: RobotTruth
    drawn: tuple[tuple[float, NDArray[np.float64]], ...]
    _seen: dict[int, BeamEndpoints] = field(default_factory=dict)

    def seen(self, now: float) -> BeamEndpoints:
        """Return the endpoints of the beams in its last map until a time [s], as drawn there and in the world."""
        last = bisect.bisect_right(self.drawn, now, key=lambda each: each[0]) - 1
        if last not in self._seen:
            poses = self.drawn[last][1]
            scans = len(poses)
            self._seen[last] = beam_endpoints(
                self.sensed.log.part(0, scans),
                self.truth.part(0, scans),
                Trajectory(self.truth.trajectory.stamps[:scans], poses),
                self.sensed.outliers[:scans],
            )
        return self._seen[last]


@dataclass(frozen=True)
class PairError:
    """Hold the error of two poses, the residual of their truth [m], and if the score counts the maps as ``distorted``:
    the residual is more than half of the displacement that it allows, or unknown, so that even perfect poses may miss.
    """

    error: TransformError
    residual: float
    distorted: bool

    @property
    def right(self) -> bool:
        """True within the tolerance of the score."""
        return RIGHT.holds(self.error)

    @property
    def elsewhere(self) -> bool:
        """True if the maps are not even in the right place."""
        return not RIGHT_PLACE.holds(self.error)

    @property
    def wrong(self) -> bool:
        """True if the poses are not right, and no distortion excuses them."""
        return self.elsewhere or not (self.right or self.distorted)


@dataclass(frozen=True, eq=False)
class LiveTeam:
    """Hold a mission as a live merge hears it: ``messages`` with their times [s], in order, and the robots' truth."""

    plan: MissionPlan
    messages: tuple[tuple[float, MapMessage], ...]
    robots: Mapping[str, MappedRobot]

    def error(
        self, grids: Mapping[str, OccupancyGrid], poses: Mapping[str, Similarity2], pair: tuple[str, str], now: float
    ) -> PairError:
        """Compare two published poses with the truth, fitted to the true cells that both saw until ``now`` [s].

        Without such cells the truth is composed of those of the two maps, and the error is that of all source cells.
        """
        target, source = pair
        there, here = self.robots[target].seen(now), self.robots[source].seen(now)
        rows_t, rows_s = common_rows(there, here)
        shared = len(rows_t) >= MIN_COMMON_CELLS
        if shared:
            rigid = fit_rigid(here.estimated[rows_s], there.estimated[rows_t])
            apart = rigid.apply(here.estimated[rows_s]) - there.estimated[rows_t]
            residual = math.sqrt(float((apart**2).sum(axis=1).mean()))
        else:
            rigid = fit_rigid(there.estimated, there.true).inverse() @ fit_rigid(here.estimated, here.true)
            residual = math.inf
        truth, answer = Similarity2.from_se2(rigid), poses[target].inverse() @ poses[source]
        error = transform_error(grids[target], grids[source], truth, answer, cells="common" if shared else "source")
        allowed = RIGHT.displacement_of_diagonal * grids[target].known_diagonal
        return PairError(error, residual, residual > 0.5 * allowed)

    def shared_cells(self, pair: tuple[str, str], now: float) -> int:
        """Count the true wall cells that two robots saw until ``now`` [s]."""
        return len(common_rows(self.robots[pair[0]].seen(now), self.robots[pair[1]].seen(now))[0])


def simulate_team(plan: MissionPlan, period: float = 2.0) -> LiveTeam:
    """Simulate a mission; each robot sends its map every ``period`` [s], as ``mapquilt play`` sends it."""
    robot = RobotSettings(lidar=lidar_at_rate("default", SCANS_PER_SECOND))
    settings = MissionSettings((robot,) * plan.robots, plan.duration, plan.starts)
    mission, _ = simulate(make_world(plan.family, plan.seed, *(plan.size or (None, None))), settings, plan.seed)
    levels = [f"sensing.noise={plan.noise:g}"]
    levels += [f"sensing.adversity.level={plan.adversity:g}"] if plan.adversity else []
    sensing = with_assignments(ExperimentConfig(), "set", levels, COMBINED).sensing
    paths = [truth.trajectory for truth in mission.robots]
    around = draw_surroundings(mission.world, paths, sensing.adversity, plan.seed)
    sensed = [
        sense(truth, sensing.noise_of(robot.lidar.model), plan.seed, index, around)
        for index, truth in enumerate(mission.robots)
    ]
    names = [f"robot_{index}" for index in range(plan.robots)]
    robots = [
        RunRobot(name, replace(each.log, robot=name), map_log(each.log, truth.trajectory), truth.trajectory)
        for name, each, truth in zip(names, sensed, mission.robots, strict=True)
    ]
    sources = {robot.name: _LastPoses(online_poses(robot.log)) for robot in robots}
    messages: list[tuple[float, MapMessage]] = []
    drawn: dict[str, list[tuple[float, NDArray[np.float64]]]] = {name: [] for name in names}
    for topic, message, _ in team_messages(robots, list(sources.values()), period):
        if topic.endswith("/map"):
            name = topic.split("/")[1]
            sent = map_message(name, message)
            messages.append((sent.stamp - BAG_START, sent))
            drawn[name].append((sent.stamp - BAG_START, sources[name].poses))
    mapped = {
        name: MappedRobot(each, truth, tuple(drawn[name]))
        for name, each, truth in zip(names, sensed, mission.robots, strict=True)
    }
    return LiveTeam(plan, tuple(messages), mapped)


class _LastPoses:
    """Iterate over the poses of a robot's scans so far, and keep the last ones."""

    def __init__(self, source: Iterator[NDArray[np.float64]]) -> None:
        self.poses = np.empty((0, 3))
        self._source = source

    def __iter__(self) -> Iterator[NDArray[np.float64]]:
        for poses in self._source:
            self.poses = poses
            yield poses
