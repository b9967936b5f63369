"""Data of the 3-D view: triangles cover each wall once, and scans and poses come out as they went in."""

from __future__ import annotations

import base64

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapquilt.report.mission_view import MOST_FRAMES, mission_view, triangles
from mapquilt.runs import folder as run_folder
from sim.mission.file import load_mission
from worlds.polygon import signed_area


def star(radii: list[float]) -> np.ndarray:
    """A simple polygon about the origin, counter-clockwise, seldom convex."""
    angles = 2.0 * np.pi * np.arange(len(radii)) / len(radii)
    return np.stack((np.cos(angles), np.sin(angles)), axis=-1) * np.array(radii)[:, None]


@given(st.lists(st.floats(0.2, 5.0), min_size=3, max_size=16))
def test_the_triangles_of_a_polygon_cover_it_once(radii: list[float]) -> None:
    polygon = star(radii)
    areas = [signed_area(polygon[corners]) for corners in triangles(polygon)]
    assert len(areas) == len(polygon) - 2
    assert min(areas) > -1e-9  # none overlaps another, since all turn one way and the areas add up
    assert sum(areas) == pytest.approx(signed_area(polygon))


def test_a_step_is_cut_at_its_inner_corner() -> None:
    step = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], float)
    areas = [signed_area(step[corners]) for corners in triangles(step)]
    assert min(areas) > 0.0
    assert sum(areas) == pytest.approx(3.0)


def test_poses_and_scans_are_those_of_the_mission(merged_run) -> None:
    mission = load_mission(run_folder.mission_folder(merged_run))
    view = mission_view(mission)
    assert view["size"] == list(mission.world.size)
    assert len(view["walls"]) == len(mission.world.obstacles)
    assert 2 <= len(view["times"]) <= MOST_FRAMES
    for truth, robot in zip(mission.robots, view["robots"], strict=True):
        beams = len(robot["angles"])
        ranges = np.frombuffer(base64.b64decode(robot["ranges"]), "<u2").reshape(-1, beams) / 1000.0
        poses = np.reshape(robot["frames"], (-1, 3))
        stride = truth.scans[0].ranges.size / beams
        for k, time in enumerate(view["times"]):
            last = np.flatnonzero(truth.trajectory.stamps <= time + 1e-3)[-1]
            np.testing.assert_allclose(poses[k], truth.trajectory.poses[last], atol=6e-4)
            for beam in (0, beams // 2, beams - 1):
                read = truth.scans[last].ranges[int(beam * stride)]
                shown = np.isfinite(read) and not truth.hits_robot[last, int(beam * stride)]
                assert ranges[k, beam] == pytest.approx(read if shown else 0.0, abs=6e-4)
