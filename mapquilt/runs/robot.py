"""Robots of a run with their logs, maps and true trajectories, for export."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.robot_log import RobotLog
from mapping.robot.trajectory import Trajectory
from mapquilt.runs import folder as run_folder
from mapquilt.runs.true_footprints import map_names, part_bounds
from sim.mission.file import load_mission
from sim.mission.mission import Mission


@dataclass(frozen=True, eq=False)
class RunRobot:
    """Hold a robot's ``name``, its ``log``, its map ``grid`` in a perturbed frame, and its true poses
    ``world_from_base`` at the stamps of the log. If a mission was cut in time, each part is a robot of its own.

    Raises ``ValueError`` if truth and log have different stamps.
    """

    name: str
    log: RobotLog
    grid: OccupancyGrid
    world_from_base: Trajectory

    def __post_init__(self) -> None:
        if not np.array_equal(self.log.odometry.stamps, self.world_from_base.stamps):
            raise ValueError(f"{self.name}: log and truth have different stamps; they are of different missions")


def load_run_robots(run: Path) -> tuple[RunRobot, ...]:
    """Load the robots of a run. Raises ``ValueError`` or ``OSError`` naming the file that is missing or wrong."""
    maps = run_folder.load_maps(run)
    mission_folder = run_folder.mission_folder(run)
    paths = _true_paths(load_mission(mission_folder), run_folder.parts(run))
    if tuple(paths) != maps.names:
        raise ValueError(f"{mission_folder}: holds {', '.join(paths)}, but the run has {', '.join(maps.names)}")
    return tuple(
        RunRobot(name, run_folder.load_log(run, name), grid, paths[name])
        for name, grid in zip(maps.names, maps.grids, strict=True)
    )


def _true_paths(mission: Mission, parts: int) -> dict[str, Trajectory]:
    """Return the true trajectory behind each map."""
    cuts = [
        truth.trajectory.part(*part_bounds(len(truth.scans), part, parts))
        for truth in mission.robots
        for part in range(parts)
    ]
    return dict(zip(map_names(len(mission.robots), parts), cuts, strict=True))
