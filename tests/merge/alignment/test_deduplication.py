import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.alignment.deduplication import deduplicate, rms_displacement
from merge.preparation.prepared_map import PreparedMap
from merge.records.proposal import Proposal
from tests.merge.rooms import rooms


@pytest.fixture(scope="module")
def prepared():
    walls = rooms(np.random.default_rng(11)).walls
    values = np.where(walls, 100, 0)
    return PreparedMap(OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), values.shape), values))


def test_the_distance_of_two_transforms_is_that_of_the_points_they_move(prepared):
    a, b = Similarity2(3.0, -4.0, 0.3, 1.2), Similarity2(-10.0, 20.0, 0.5, 0.9)
    moved = np.hypot(*(a.apply(prepared.points) - b.apply(prepared.points)).T)
    found = rms_displacement(prepared, [a, b])
    assert found[0, 1] == pytest.approx(np.sqrt((moved**2).mean()))
    assert found[0, 0] == 0.0 and found[1, 0] == found[0, 1]


def test_near_duplicates_become_votes_of_the_first(prepared):
    near = 0.01 * prepared.diagonal
    proposals = [Proposal(Similarity2(x)) for x in (0.0, near, 500.0, -near, 500.0 + near, 900.0)]
    kept = deduplicate(prepared, prepared, proposals, 0.035)
    assert [(p.target_from_source.x, p.votes) for p in kept] == [(0.0, 3), (500.0, 2), (900.0, 1)]
    assert deduplicate(prepared, prepared, [], 0.035) == []
