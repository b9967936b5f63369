import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.scale_range import ScaleRange
from merge.literature.icp import Icp
from merge.literature.nearest_wall import NearestWall
from merge.preparation.surface import centres
from tests.merge.literature.crisp import crisp_pair


def slow(walls, points):
    """Distance to the nearest, by looking at all."""
    return np.abs(points[..., None] - walls).min(axis=-1)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), share=st.floats(0.002, 0.3))
def test_the_nearest_is_found_to_a_fifth_of_a_cell_and_nearly_always_exactly(seed, share):
    rng = np.random.default_rng(seed)
    mask = rng.random((30, 45)) < share
    mask[rng.integers(30), rng.integers(45)] = True
    cells = centres(mask)
    walls = cells[:, 0] + 1j * cells[:, 1]
    low, high = cells.min(axis=0) - 12.0, cells.max(axis=0) + 12.0
    points = rng.uniform(low[0], high[0], (3, 200)) + 1j * rng.uniform(low[1], high[1], (3, 200))
    distance, index = NearestWall.of(walls, 12.0).query(points)
    assert distance == pytest.approx(np.abs(points - walls[index]))
    off = distance - slow(walls, points)
    assert off.min() > -1e-9
    assert off.max() < 0.2
    assert np.mean(off > 1e-9) < 0.02


def test_beyond_the_reach_a_border_cell_is_returned():
    walls = np.array([2.5 + 3.5j, 90.5 + 3.5j])
    distance, index = NearestWall.of(walls, 5.0).query(np.array([[-400.0 + 50.0j, 400.0 - 50.0j]]))
    assert index.tolist() == [[0, 1]]
    assert distance[0] == pytest.approx(slow(walls, np.array([-400.0 + 50.0j, 400.0 - 50.0j])))


@pytest.mark.parametrize("size", [0.5, 1.0, 2.0])
def test_no_state_of_icp_ever_leaves_the_reach(size, monkeypatch):
    target, source, _ = crisp_pair()
    seen = []
    query = NearestWall.query

    def watched(self, points):
        col, row = points.real - self.corner[0], points.imag - self.corner[1]
        rows, cols = self.index.shape
        seen.append(bool(((col > 1) & (col < cols - 1) & (row > 1) & (row < rows - 1)).all()))
        return query(self, points)

    monkeypatch.setattr(NearestWall, "query", watched)
    method = Icp(rotations=8)
    maps = method.describe(target), method.describe(source)
    assert method.propose(*maps, ScaleRange(size, size), np.random.default_rng(0))
    assert len(seen) > 3
    assert all(seen)
