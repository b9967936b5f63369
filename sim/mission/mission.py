"""A team of robots in a world: simulated once, kept clean."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace

from mapping.ground_truth.footprint import TRUE_RESOLUTION
from mapping.robot.robot_log import RobotTruth
from mapping.robot.trajectory import Trajectory
from mapping.seeds import Role, stream
from sim.mission.overlap import attempts, overlap_cut
from sim.mission.replay import Replayed, check_replay
from sim.mission.running import Driven, Mover, run_team
from sim.mission.settings import MissionSettings
from sim.mission.starts import choose_starts
from sim.physics.bullet import BulletScene
from sim.physics.stopwatch import Stopwatch
from sim.policies.controllers import make_navigators
from worlds.raster import true_raster
from worlds.world import World


@dataclass(frozen=True, eq=False)
class Mission:
    """What truly happened: one truth a robot, in a ``world``; robots with other lidars have other stamps.

    Nothing in it depends on sensor noise; ``sense`` draws the noise on it afterwards. ``touches``
    counts for each robot the scan periods in which it touched a wall or another robot. Where the mission was cut to
    reach an overlap, truths end before ``settings.duration``.
    """

    world: World
    robots: tuple[RobotTruth, ...]
    seed: int
    settings: MissionSettings
    touches: tuple[int, ...]

    def cut(self, scans: Sequence[int]) -> Mission:
        """The same mission with only so many scans of each robot, from the first on."""
        robots = tuple(truth.part(0, count) for truth, count in zip(self.robots, scans, strict=True))
        return replace(self, robots=robots)


@dataclass(frozen=True)
class MissionTimes:
    """Seconds of wall time that a mission took, by what they went into. They are no part of the mission."""

    building: float = 0.0
    physics: float = 0.0
    rays: float = 0.0
    mapping: float = 0.0
    planning: float = 0.0
    cutting: float = 0.0
    total: float = 0.0


def simulate(
    world: World,
    settings: MissionSettings,
    seed: int,
    on_progress: Callable[[float], None] | None = None,
    replay: Sequence[Trajectory] = (),
    clear_range: float = 0.0,
) -> tuple[Mission, MissionTimes]:
    """Let the robots drive in the world. Equal arguments give an equal mission, bit for bit, in any process.

    Every robot scans at its lidar's rate from 0 s to the end; one that finds nothing more to do stands still and goes
    on scanning, and is still seen by the others. ``on_progress`` is told the simulated time [s] after each scan.
    ``replay`` holds world_from_base over time of each robot, for the policy of that name. Where an overlap is wanted,
    the mission is cut to reach it, and simulated again from other starts where that fails; the one that comes nearest
    is kept; ``clear_range`` [m] is how far a beam without a return sees there.

    Raises ``ValueError`` where the world does not hold the robots, a start, a goal or a trajectory; ``ImportError``
    without PyBullet.
    """
    stopwatch = Stopwatch()
    check_replay(world, settings, replay)
    with stopwatch.on("total"):
        mission = _first_that_overlaps(
            (_drive(world, attempt, seed, replay, stopwatch, on_progress) for attempt in attempts(settings)),
            settings.overlap,
            clear_range,
            stopwatch,
        )
    return mission, MissionTimes(**stopwatch.seconds)


def _first_that_overlaps(
    missions: Iterator[Mission], wanted: tuple[float, float] | None, clear_range: float, stopwatch: Stopwatch
) -> Mission:
    """The first of the missions, cut where an overlap is wanted, that reaches it, or the one that comes nearest."""
    best: tuple[float, Mission] | None = None
    for mission in missions:
        if wanted is None:
            return mission
        with stopwatch.on("cutting"):
            frame = true_raster(mission.world, TRUE_RESOLUTION).frame
            cut = overlap_cut(mission.robots, frame, wanted, clear_range)
        if best is None or cut.miss < best[0]:
            best = cut.miss, mission.cut(cut.scans)
        if cut.miss == 0.0:
            break
    if best is None:
        raise ValueError("no mission to choose from")
    return best[1]


def _drive(
    world: World,
    settings: MissionSettings,
    seed: int,
    replay: Sequence[Trajectory],
    stopwatch: Stopwatch,
    on_progress: Callable[[float], None] | None,
) -> Mission:
    robots = settings.robots
    with ExitStack() as stack:
        with stopwatch.on("building"):
            if replay:
                starts = tuple(path.pose(0) for path in replay)
            else:
                starts = choose_starts(stream(seed, Role.STARTS), world, robots, settings.starts)
            scene = stack.enter_context(BulletScene(world, starts, robots, settings.drive))
            mover: Mover
            if replay:
                mover = Replayed(scene, replay, stopwatch)
            else:
                pilots = make_navigators(world, settings, starts, seed, stopwatch)
                mover = Driven(scene, settings.drive, pilots, stopwatch)
        recorders = run_team(scene, robots, settings.duration, mover, stopwatch, on_progress)
    truths = tuple(recorder.truth() for recorder in recorders)
    return Mission(world, truths, seed, settings, tuple(recorder.touches for recorder in recorders))
