"""Laws of the arrangement and of its history."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.align.arrangement import Arrangement, History, Placement, start_arrangement

numbers = st.floats(-50.0, 50.0)
poses = st.builds(Similarity2, numbers, numbers, st.floats(-3.0, 3.0), st.floats(0.5, 2.0))
steps = st.lists(st.one_of(st.tuples(st.integers(0, 2), poses), st.sampled_from(["undo", "redo"])), max_size=30)


def blank(number: int) -> Arrangement:
    return Arrangement((Placement(Similarity2()),) * number)


@given(steps)
def test_a_history_is_a_list_with_a_cursor(steps: list) -> None:
    history, states, at = History(blank(3)), [blank(3)], 0
    states[0] = history.now
    for step in steps:
        if step == "undo":
            history, at = history.undone(), max(0, at - 1)
        elif step == "redo":
            history, at = history.redone(), min(len(states) - 1, at + 1)
        else:
            index, pose = step
            new = history.now.placed(index, Placement(pose, "hand"))
            history, states, at = history.changed(new), [*states[: at + 1], new], at + 1
        assert history.now is states[at]
        assert (len(history.past), len(history.future)) == (at, len(states) - 1 - at)


@given(poses, poses, poses)
def test_the_relative_pose_does_not_depend_on_the_place_on_the_sheet(a, b, move) -> None:
    there = blank(2).placed(0, Placement(a)).placed(1, Placement(b))
    moved = blank(2).placed(0, Placement(move @ a)).placed(1, Placement(move @ b))
    points = np.array([[0.0, 0.0], [3.0, -2.0]])
    np.testing.assert_allclose(
        moved.target_from_source(0, 1).apply(points), there.target_from_source(0, 1).apply(points), atol=1e-6
    )


@pytest.mark.parametrize(("unit", "scale"), [("m", 1.0), ("cell", 0.05)])
def test_maps_start_with_their_middles_on_one_another_and_cells_of_one_size(unit, scale) -> None:
    cells = np.zeros((6, 10), np.float32)
    cells[1:4, 2:9] = 1.0
    grids = (
        OccupancyGrid(GridFrame(0.05, SE2(3.0, -2.0, 0.4), (6, 10)), cells),
        OccupancyGrid(GridFrame(0.05 if unit == "m" else 1.0, SE2(-7.0, 1.0, 1.1), (6, 10)), cells),
    )
    start = start_arrangement(MapSet(("a", "b"), grids, ("m", unit)))
    middles = [
        placement.sheet_from_map.apply(grid.frame.metres_from_cells([2.0, 5.0]))
        for placement, grid in zip(start.placements, grids, strict=True)
    ]
    np.testing.assert_allclose(middles[0], middles[1], atol=1e-9)
    assert start.placements[1].sheet_from_map.scale == pytest.approx(scale)
