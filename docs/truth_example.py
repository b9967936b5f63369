"""Print the numbers and draw the picture of docs/truth.md: ``python docs/truth_example.py RUN PICTURE``."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from mapping.geometry.similarity2 import Similarity2
from mapping.io.atomic import write_bytes_atomically
from mapping.io.robot_log_file import load_robot_log
from mapping.map_set import MapSet
from mapquilt.evaluation.transform_error import transform_error
from mapquilt.runs import folder as run_folder
from mapquilt.runs.truth_file import RunTruth, load_truth
from mapquilt.viz.palette import TRUE_WALL, robot_colour
from mapquilt.viz.png import figure_png
from sim.mission.file import load_mission
from sim.mission.mission import Mission

TARGET, SOURCE = "robot_0", "robot_1"


def main(run: Path, picture: Path) -> None:
    mission = load_mission(run / run_folder.MISSION_FOLDER)
    maps, truth = run_folder.load_maps(run), load_truth(run / run_folder.TRUTH_FILE)
    for index, name in enumerate((TARGET, SOURCE)):
        sys.stdout.write(robot_text(run, mission, truth, index, name))
    sys.stdout.write(pair_text(maps, truth))
    write_bytes_atomically(picture, figure_png(draw(mission, maps, truth)))


def robot_text(run: Path, mission: Mission, truth: RunTruth, index: int, name: str) -> str:
    """Describe the drift at the end of the path, the best fit and the distortion."""
    true = mission.robots[index].trajectory
    believed = load_robot_log(run / name / "log.npz").odometry.from_start()
    end = (true.pose(0) @ believed.pose(len(believed) - 1)).inverse() @ true.pose(len(true) - 1)
    fit = truth.robot(name).truth
    moved = fit.world_from_start_map.inverse() @ fit.world_from_map
    return (
        f"{name}: path {true.distance():.1f} m; drift at its end {math.hypot(end.x, end.y):.2f} m, "
        f"{abs(math.degrees(end.yaw)):.1f} degrees; best fit rotates the map by {math.degrees(moved.yaw):.2f} degrees "
        f"against its start; distortion {fit.distortion:.3f} m\n"
    )


def composed(truth: RunTruth) -> Similarity2:
    """Compose the fits of the two maps to a transform of the pair."""
    return truth.robot(TARGET).truth.world_from_map.inverse() @ truth.robot(SOURCE).truth.world_from_map


def pair_text(maps: MapSet, truth: RunTruth) -> str:
    pair = truth.pairs[TARGET, SOURCE]
    target, source = (maps.grids[maps.names.index(name)] for name in (TARGET, SOURCE))
    scale = truth.robot(TARGET).truth.world_from_map.scale
    miss = transform_error(target, source, pair.target_from_source, composed(truth), scale)
    return (
        f"pair: overlap {100 * pair.footprints.overlap:.0f} %, {pair.common_cells} common wall cells, residual "
        f"{pair.residual:.3f} m; composing the two fits misses it by {miss.displacement_m:.3f} m and "
        f"{miss.rotation_deg:.2f} degrees\n"
    )


def draw(mission: Mission, maps: MapSet, truth: RunTruth) -> Figure:
    figure = Figure(figsize=(15, 4.2), layout="constrained", dpi=110)
    start, best, pair = figure.subplots(1, 3, sharex=True, sharey=True)
    fits = [truth.robot(name).truth for name in (TARGET, SOURCE)]
    world_from_target = fits[0].world_from_map
    panels = (
        (
            start,
            [fit.world_from_start_map for fit in fits],
            "each map where its robot started: drift shows at the ends",
        ),
        (best, [fit.world_from_map for fit in fits], "each map at its best fit: what remains is distortion"),
        (
            pair,
            [world_from_target, world_from_target @ truth.pairs[TARGET, SOURCE].target_from_source],
            f"{TARGET} at its best fit, {SOURCE} by the truth of the pair",
        ),
    )
    for axes, world_from_maps, title in panels:
        show(axes, mission, maps, world_from_maps)
        axes.set_title(title, fontsize=9, loc="left")
    start.set_ylabel("y [m]", fontsize=8)
    return figure


def show(axes: Axes, mission: Mission, maps: MapSet, world_from_maps: list[Similarity2]) -> None:
    axes.add_collection(PolyCollection(mission.world.obstacles, facecolors=TRUE_WALL, edgecolors="none"))
    for index, (name, world_from_map) in enumerate(zip((TARGET, SOURCE), world_from_maps, strict=True)):
        grid = maps.grids[maps.names.index(name)]
        walls = world_from_map.apply(grid.frame.metres_from_cells(np.argwhere(grid.occupied)))
        axes.plot(*walls.T, ",", color=robot_colour(index))
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]", fontsize=8)
    axes.tick_params(labelsize=7)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
