"""Simulate a team of robots in a world, without noise."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

from mapping.ground_truth.footprint import TRUE_RESOLUTION
from mapping.robot.trajectory import Trajectory
from mapping.seeds import Role, stream
from sim.mission.controllers import make_navigators
from sim.mission.mission import Mission
from sim.mission.overlap import StartAttempt, cut_to_overlap, start_attempts
from sim.mission.replay import Replayed, check_replay
from sim.mission.running import Driven, Mover, run_team
from sim.mission.settings import MissionSettings
from sim.mission.starts import choose_starts
from sim.physics.bullet import BulletScene
from sim.physics.stopwatch import Stopwatch
from worlds.raster import true_raster
from worlds.world import World


@dataclass(frozen=True)
class MissionTimes:
    """Hold the wall time [s] of each part of a simulation. It is not part of the mission."""

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
    """Simulate a mission. Equal arguments give an equal mission, bit for bit, in any process.

    Every robot scans at its lidar's rate from 0 s to the end. A robot that has finished stands still, goes on scanning,
    and stays visible to the others. ``on_progress`` is called with the simulated time [s] after each scan. ``replay``
    holds one world_from_base trajectory per robot, for the policy ``replay``. If the settings ask for an overlap, the
    mission is cut to reach it. If that fails, it is simulated again from other starts, of the same kind unless they are
    random, and the closest result is kept.
    ``clear_range`` [m] is how far a beam without a return sees there.

    Raises ``ValueError`` if the robots do not fit into the world, or a start, goal or trajectory is not valid;
    ``ImportError`` without PyBullet.
    """
    stopwatch = Stopwatch()
    check_replay(world, settings, replay)
    with stopwatch.measure("total"):
        mission = _best_overlap(
            (_drive(world, attempt, seed, replay, stopwatch, on_progress) for attempt in start_attempts(settings)),
            settings,
            clear_range,
            stopwatch,
        )
    return mission, MissionTimes(**stopwatch.seconds)


def _best_overlap(
    missions: Iterator[Mission], settings: MissionSettings, clear_range: float, stopwatch: Stopwatch
) -> Mission:
    """Cut missions until one reaches the overlap, and return it, or the closest one. Without a target, return the
    first."""
    best: tuple[float, Mission] | None = None
    for mission in missions:
        if settings.overlap is None:
            return mission
        with stopwatch.measure("cutting"):
            frame = true_raster(mission.world, TRUE_RESOLUTION).frame
            cut = cut_to_overlap(mission.robots, frame, settings.overlap, clear_range, settings.cut)
        if best is None or cut.error < best[0]:
            best = cut.error, mission.cut(cut.scans)
        if cut.error == 0.0:
            break
    if best is None:
        raise ValueError("no mission to choose from")
    return best[1]


def _drive(
    world: World,
    attempt: StartAttempt,
    seed: int,
    replay: Sequence[Trajectory],
    stopwatch: Stopwatch,
    on_progress: Callable[[float], None] | None,
) -> Mission:
    settings = attempt.settings
    robots = settings.robots
    with ExitStack() as stack:
        with stopwatch.measure("building"):
            if replay:
                starts = tuple(path.pose(0) for path in replay)
            else:
                gap = attempt.draw * settings.cut.gap if settings.starts == "close" else 0.0
                starts = choose_starts(stream(seed, Role.STARTS, attempt.draw), world, robots, settings.starts, gap)
            scene = stack.enter_context(BulletScene(world, starts, robots, settings.drive))
            mover: Mover
            if replay:
                mover = Replayed(scene, replay, stopwatch)
            else:
                navigators = make_navigators(world, settings, starts, seed, stopwatch)
                mover = Driven(scene, settings.drive, navigators, stopwatch)
        recorders = run_team(scene, robots, settings.duration, mover, stopwatch, on_progress)
    truths = tuple(recorder.truth() for recorder in recorders)
    return Mission(world, truths, seed, settings, tuple(recorder.contacts for recorder in recorders))
