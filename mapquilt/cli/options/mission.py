"""Define the options of the robots and their mission."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from mapping.geometry.se2 import SE2
from mapping.io.tum import load_tum
from mapping.numbers import parse_number
from mapping.robot.trajectory import Trajectory
from mapquilt.cli.options.robots_file import load_robots
from sim.mission.settings import MissionSettings, PolicyName, Starts
from sim.physics.drive import Drive, DriveLimits
from sim.physics.robot import MAX_ROBOTS, RobotSettings
from sim.sensors.lidar import Lidar

StartOption = Annotated[
    list[str] | None, typer.Option("--start", metavar="X,Y[,YAW]", help="Start pose of a robot [m, rad]. Repeatable.")
]
GoalOption = Annotated[
    list[str] | None, typer.Option("--goal", metavar="X,Y", help="Goal of the patrol [m]. Repeatable.")
]
ReplayOption = Annotated[
    list[Path] | None,
    typer.Option("--replay", metavar="FILE", help="TUM trajectory for a robot to follow in the world. Repeatable."),
]
RobotsFile = Annotated[Path | None, typer.Option(help="YAML file with the settings of each robot.")]
OverlapOption = Annotated[
    str | None,
    typer.Option(metavar="LO:HI", help="Cut the mission so that any two maps have this true overlap, 0 to 1."),
]

ROBOTS = 3
DURATION = 120.0
SEED = 6
"""Default seed of worlds and missions, so that `worlds show` draws the world that `simulate` uses."""


@dataclass(frozen=True)
class MissionOptions:
    """Hold the options as given; None or empty for options that were not given."""

    robots: int | None
    duration: float | None
    lidar: Lidar
    starts: Starts
    start: Sequence[str]
    robots_file: Path | None
    drive: Drive
    speed: float
    turn_rate: float
    policy: PolicyName | None
    goal: Sequence[str]
    replay: Sequence[Path]
    overlap: str | None


def parse_mission(options: MissionOptions) -> tuple[MissionSettings, tuple[Trajectory, ...]]:
    """Return the mission settings, and the trajectories to replay.

    The number of robots defaults to the number of starts, robots in the file or trajectories, or three. The duration
    defaults to that of the longest trajectory, or 120 s. Goals and trajectories select their policy. Raises
    ``ValueError`` with the option and its value.
    """
    replay = tuple(load_tum(path) for path in options.replay)
    longest = max((float(path.stamps[-1] - path.stamps[0]) for path in replay), default=DURATION)
    settings = MissionSettings(
        robots=_team(options),
        duration=options.duration if options.duration is not None else longest,
        starts=options.starts,
        drive=options.drive,
        policy=options.policy or ("replay" if replay else "patrol" if options.goal else "explore"),
        goals=[_goal(text) for text in options.goal],
        overlap=None if options.overlap is None else _range(options.overlap),
    )
    return settings, replay


def _team(options: MissionOptions) -> int | tuple[RobotSettings, ...]:
    limits = DriveLimits(options.speed, options.turn_rate)
    each = RobotSettings(options.lidar, limits)
    starts = [_start(text) for text in options.start]
    if options.robots_file is not None:
        if starts:
            raise ValueError("--start: give starts in the robots file or by --start, not in both")
        team = load_robots(options.robots_file, each)
        if options.robots not in (None, len(team)):
            raise ValueError(f"--robots {options.robots}, but {options.robots_file} holds {len(team)}")
        return team
    count = options.robots if options.robots is not None else len(starts) or len(options.replay) or ROBOTS
    if not 1 <= count <= MAX_ROBOTS:
        return count  # which the mission's settings refuse
    if len(starts) > count:
        raise ValueError(f"--start: {len(starts)} starts, but --robots {count}")
    pairs = itertools.zip_longest(starts, range(count))
    return tuple(RobotSettings(each.lidar, each.limits, each.radius, start) for start, _ in pairs)


def _start(text: str) -> SE2:
    numbers = _numbers(text)
    if len(numbers) not in (2, 3):
        raise ValueError(f"--start {text}: must be X,Y or X,Y,YAW in metres and radians")
    return SE2(*numbers)


def _goal(text: str) -> tuple[float, float]:
    numbers = _numbers(text)
    if len(numbers) != 2:
        raise ValueError(f"--goal {text}: must be X,Y in metres")
    return numbers[0], numbers[1]


def _range(text: str) -> tuple[float, float]:
    numbers = _numbers(text, ":")
    if len(numbers) != 2:
        raise ValueError(f"--overlap {text}: must be LO:HI, such as 0.3:0.5")
    return numbers[0], numbers[1]


def _numbers(text: str, separator: str = ",") -> list[float]:
    try:
        return [parse_number(part) for part in text.split(separator)]
    except ValueError:
        return []
