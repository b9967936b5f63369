"""The merged map against the true raster: known shares, whatever frame the merge lies in."""

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.truth import MapTruth
from mapping.map_set import MapSet
from mapquilt.evaluation.merged_score import merged_score
from mapquilt.runs.truth_file import RobotOrigin, RunTruth

WORLD_FRAME = GridFrame(0.05, SE2(), (60, 80))
VALUES = np.zeros((60, 80))
VALUES[:3] = VALUES[-3:] = VALUES[:, :3] = VALUES[:, -3:] = VALUES[20:24, 30:60] = 100
WORLD = OccupancyGrid.from_occupancy(WORLD_FRAME, VALUES)


def scored(merged, world_from_map, seen=None):
    """The score of one map that is its own merge; its truth is ``world_from_map``."""
    maps = MapSet(("a",), (merged,), ("m",))
    truth = RunTruth((RobotOrigin("a", SE2(), Similarity2(), MapTruth(world_from_map, world_from_map, 0.0)),), {})
    footprint = OccupancyGrid(
        WORLD_FRAME, np.where(np.ones((60, 80), bool) if seen is None else seen, WORLD.log_odds, 0)
    )
    return merged_score(maps, truth, {"a": Similarity2()}, "a", merged, WORLD, {"a": footprint})


@pytest.mark.parametrize("pose", [Similarity2(), Similarity2(3.0, -2.0, np.pi / 2, 2.0), Similarity2(-1.0, 4.0, np.pi)])
def test_the_truth_itself_is_perfect_in_any_frame(pose):
    there = pose.inverse() @ Similarity2.from_se2(WORLD_FRAME.origin)
    frame = GridFrame(0.05 / pose.scale, SE2(there.x, there.y, there.yaw), (60, 80))
    score = scored(OccupancyGrid(frame, WORLD.log_odds), pose)
    assert (score.iou_free, score.f1_walls) == (1.0, 1.0)
    assert score.pose_error_m == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("cells", "perfect"), [(1, True), (2, False)])
def test_walls_may_lie_one_cell_off_and_no_more(cells, perfect):
    moved = OccupancyGrid(WORLD_FRAME, np.roll(WORLD.log_odds, cells, axis=1))
    assert (scored(moved, Similarity2()).f1_walls == 1.0) is perfect


def test_shares_by_hand_and_only_where_robots_could_look():
    values = VALUES.copy()
    values[20:24, 30:60] = 0  # a wall is missing: 120 cells
    merged = OccupancyGrid.from_occupancy(WORLD_FRAME, values)
    score = scored(merged, Similarity2())
    free = int((VALUES == 0).sum())
    assert score.iou_free == pytest.approx(free / (free + 120))
    assert score.precision_walls == 1.0
    walls = int((VALUES == 100).sum())
    assert score.recall_walls == pytest.approx((walls - 120) / walls)
    seen = np.ones((60, 80), bool)
    seen[15:30] = False
    assert scored(merged, Similarity2(), seen).iou_free == 1.0
