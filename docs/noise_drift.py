"""Measure the drift of odometry at level 1 on the paths of runs: ``python docs/noise_drift.py RUN...``."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mapping.robot.trajectory import Trajectory
from mapping.seeds import Role, stream
from mapquilt.runs import folder as run_folder
from sim.mission.file import load_mission
from sim.sensors.odometry import OdometryNoise, draw_bias, simulate_odometry

SEEDS = 30
"""Number of random drifts per path."""


def main(runs: list[Path]) -> None:
    paths = [robot.trajectory for run in runs for robot in load_mission(run / run_folder.MISSION_FOLDER).robots]
    lengths = [path.distance() for path in paths]
    usual = OdometryNoise()
    sys.stdout.write(f"{len(paths)} paths of {min(lengths):.0f} to {max(lengths):.0f} m, {SEEDS} drifts each\n")
    for name, noise in (
        ("alphas alone", replace(usual, radius_sigma=0.0, track_sigma=0.0, veer_sigma=0.0)),
        ("wheels alone", replace(usual, alpha1=0.0, alpha2=0.0, alpha3=0.0, alpha4=0.0)),
        ("level 1", usual),
        ("level 3", usual.scaled(3.0)),
    ):
        drifts = np.array([drift(path, noise, index) for index, path in enumerate(paths)])
        sys.stdout.write(f"{name}: {summary(drifts)}\n")


def drift(path: Trajectory, noise: OdometryNoise, index: int) -> NDArray[np.float64]:
    """Draw errors at the end of a path, (SEEDS, 2): per cent of the distance, and degrees."""
    end, errors = path.from_start().poses[-1], []
    for seed in range(SEEDS):
        bias = draw_bias(noise, stream(seed, Role.ODOMETRY_BIAS, index))
        x, y, yaw = simulate_odometry(path, noise, bias, stream(seed, Role.ODOMETRY_NOISE, index)).poses[-1] - end
        errors.append((100.0 * math.hypot(x, y) / path.distance(), math.degrees(yaw)))
    return np.array(errors)


def summary(drifts: NDArray[np.float64]) -> str:
    """Describe the RMS over all paths, and the range of the RMS of single paths."""
    percent, degrees = np.sqrt((drifts**2).mean(axis=(0, 1)))
    least, most = (bound(np.sqrt((drifts**2).mean(axis=1)), axis=0) for bound in (np.min, np.max))
    return (
        f"{degrees:.1f} degrees ({least[1]:.1f} to {most[1]:.1f}), "
        f"{percent:.1f} % of the distance ({least[0]:.1f} to {most[0]:.1f})"
    )


if __name__ == "__main__":
    main([Path(argument) for argument in sys.argv[1:]])
