"""Measure each adversity at level 1 on the missions of runs: ``python docs/adversity_effect.py RUN...``."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.log_odds import map_log
from mapping.grid.sensor_model import sensor_model
from mapping.ground_truth.footprint import TRUE_RESOLUTION, footprint, observed
from mapping.robot.robot_log import RobotLog
from mapping.robot.trajectory import Trajectory
from mapping.slam.front_end import FRONT_ENDS, FrontEnd
from mapping.slam.settings import SlamSettings
from mapquilt.evaluation.map_quality import map_quality
from mapquilt.evaluation.trajectory_error import absolute_error, relative_error
from mapquilt.runs import folder as run_folder
from sim.mission.file import load_mission
from sim.mission.mission import Mission
from sim.sensors.adversity.settings import AMOUNTS, LEVEL_ONE, Adversity
from sim.sensors.adversity.surroundings import draw_surroundings
from sim.sensors.noise import Noise
from sim.sensors.sensing import SensedLog, sense
from worlds.raster import true_raster

ALONE = {name: replace(Adversity(), **{name: getattr(LEVEL_ONE, name)}) for name in AMOUNTS}
ROWS = {"none": Adversity(), **ALONE, "all": LEVEL_ONE}


def main(runs: list[Path]) -> None:
    missions = [load_mission(run / run_folder.MISSION_FOLDER) for run in runs]
    errors = [f"{what} by {name}" for name in FRONT_ENDS for what in ("error", "yaw error in 1 s")]
    head = ("at level 1", "outliers", "wall precision", "wall recall", *errors)
    write_row(head)
    write_row(("---",) * len(head))
    for name, adversity in ROWS.items():
        write_row((name, *described(measured(missions, adversity))))
    sys.stdout.write(f"{sum(len(each.robots) for each in missions)} robots\n")


def write_row(cells: tuple[str, ...]) -> None:
    sys.stdout.write(f"| {' | '.join(cells)} |\n")
    sys.stdout.flush()


def measured(missions: list[Mission], adversity: Adversity) -> NDArray[np.float64]:
    """Return a row of numbers for each log: outliers, wall precision and recall, and for each front end the RMS errors
    of position [m] and of the rotation within a second [rad]."""
    noise, rows = Noise(adversity=adversity), []
    for mission in missions:
        paths = [robot.trajectory for robot in mission.robots]
        around = draw_surroundings(mission.world, paths, adversity, mission.seed)
        for index, truth in enumerate(mission.robots):
            sensed = sense(truth, noise, mission.seed, index, around)
            errors = [drift(poses(sensed.log, front_end), truth.trajectory) for front_end in FRONT_ENDS.values()]
            rows.append((sensed.outliers.mean(), *walls(mission, index, sensed), *np.concatenate(errors)))
    return np.array(rows)


def poses(log: RobotLog, front_end: FrontEnd) -> Trajectory:
    return front_end(log, SlamSettings(), lambda _: None).trajectory


def drift(estimate: Trajectory, true: Trajectory) -> tuple[float, float]:
    position = absolute_error(estimate, true).position
    within = relative_error(estimate, true, 1.0, "s").error
    return math.sqrt((position**2).mean()), math.nan if within is None else within.rotation.rmse


def walls(mission: Mission, index: int, sensed: SensedLog) -> tuple[float, float]:
    """Return precision and recall of the walls of the map that is drawn at the true poses."""
    truth = mission.robots[index]
    world = true_raster(mission.world, TRUE_RESOLUTION)
    drawn = map_log(sensed.log, truth.trajectory.from_start(), 0.05, sensor_model("octomap"), 0.0)
    quality = map_quality(
        drawn, Similarity2.from_se2(truth.trajectory.pose(0)), footprint(world, observed(truth, world.frame))
    )
    return quality.precision_walls, quality.recall_walls


def described(numbers: NDArray[np.float64]) -> tuple[str, ...]:
    """Describe the means of the shares, and the RMS of the errors."""
    shares, errors = numbers[:, :3].mean(axis=0), np.sqrt((numbers[:, 3:] ** 2).mean(axis=0))
    texts = (f"{error:.2f} m" if k % 2 == 0 else f"{math.degrees(error):.2f} deg" for k, error in enumerate(errors))
    return (*(f"{100.0 * share:.1f} %" for share in shares), *texts)


if __name__ == "__main__":
    main([Path(argument) for argument in sys.argv[1:]])
