"""The true world and paths of a run, for pictures: of a mission, or of a recorded log by its reference."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.patches import Polygon as Outline
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.tum import load_tum
from mapquilt.json_file import read_record
from mapquilt.runs import folder as run_folder
from mapquilt.viz.merge_picture import extent_of, show_walls
from mapquilt.viz.palette import FENCE
from mapquilt.viz.panels import Extent
from sim.mission.file import load_mission
from sim.mission.mission import Mission


@dataclass(frozen=True)
class TrueScene:
    """Hold what a picture shows of the truth: the world's ``name`` and ``extent``, true ``paths`` (N, 3) by name, and
    ``draw_walls``, which draws the walls in one colour."""

    name: str
    extent: Extent
    paths: Mapping[str, NDArray[np.float64]]
    draw_walls: Callable[[Axes, str], None]


def load_scene(run: Path, world: OccupancyGrid) -> TrueScene:
    """Load the scene of a run whose true raster is ``world``.

    Raises ``ValueError`` or ``OSError`` naming the file that is missing or wrong.
    """
    if not run_folder.is_recorded(run):
        return mission_scene(load_mission(run_folder.mission_folder(run)))
    record = read_record(run / run_folder.RUN_FILE, "run")
    names = [entry["name"] for entry in read_record(run / run_folder.MAPS_FILE, "maps")["maps"]]
    truth = run / run_folder.TRUTH_FOLDER
    return TrueScene(
        name=record["world"],
        extent=extent_of(world),
        paths={name: load_tum(truth / f"{name}.tum").poses for name in names},
        draw_walls=lambda panel, colour: show_walls(panel, world, colour, Similarity2(), zorder=0.0),
    )


def mission_scene(mission: Mission) -> TrueScene:
    width, height = mission.world.size
    paths = {f"robot_{index}": robot.trajectory.poses for index, robot in enumerate(mission.robots)}

    def draw_walls(panel: Axes, colour: str) -> None:
        panel.add_collection(PolyCollection(mission.world.obstacles, facecolors=colour, edgecolors="none"))
        if mission.world.fence is not None:
            panel.add_patch(Outline(mission.world.fence, fill=False, edgecolor=FENCE, linestyle="--", linewidth=1.0))

    return TrueScene(mission.world.name, Extent(0.0, width, 0.0, height), paths, draw_walls)
