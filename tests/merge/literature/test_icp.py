from itertools import pairwise

import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.literature.icp import Icp, fit_rigid
from merge.preparation.prepared_map import PreparedMap
from tests.merge.literature.crisp import blank, crisp_pair, off_share


def as_complex(points):
    return points[..., 0] + 1j * points[..., 1]


def part_of(prepared, rows, cols, turned):
    """A piece of a map, turned by quarter turns, and where it lies."""
    piece = np.rot90(prepared.grid.log_odds[slice(*rows), slice(*cols)], -turned)  # rows up: counter-clockwise
    grid = OccupancyGrid(GridFrame(1.0, SE2(), piece.shape), np.ascontiguousarray(piece))
    corner = {0: (0.0, 0.0), 1: (rows[1] - rows[0], 0.0)}[turned]
    map_from_piece = Similarity2(*corner, turned * np.pi / 2)
    return PreparedMap(grid), Similarity2(cols[0], rows[0]) @ map_from_piece.inverse()


@pytest.mark.parametrize("turned", [0, 1])
def test_a_part_is_found_in_its_whole_and_accepted(turned):
    """Besl and McKay ask that the data be a part of the model."""
    whole, _, _ = crisp_pair()
    piece, truth = part_of(whole, (20, 190), (40, 240), turned)
    method = Icp()
    maps = method.describe(whole), method.describe(piece)
    answer = method.published(*maps, ScaleRange.known(), np.random.default_rng(0))
    assert answer.verdict.accepted
    assert off_share(answer.target_from_source, truth, piece) < 0.002


def test_with_half_the_overlap_the_error_stays_large_and_the_answer_is_refused():
    target, source, _ = crisp_pair()
    method = Icp(rotations=6)
    maps = method.describe(target), method.describe(source)
    verdict = method.published(*maps, ScaleRange.known(), np.random.default_rng(0)).verdict
    assert not verdict.accepted
    assert "RMS distance" in str(verdict.refusal)


@pytest.mark.parametrize("size", [1.0, 1.7])
def test_the_rigid_fit_is_umeyamas(size):
    rng = np.random.default_rng(0)
    source, targets = rng.uniform(0, 50, (20, 2)), rng.uniform(0, 50, (3, 20, 2))
    turns, shifts = fit_rigid(as_complex(targets), as_complex(source), size)
    for turn, shift, target in zip(turns, shifts, targets, strict=True):
        exact = fit_similarity(target, source, ScaleRange(size, size))
        assert turn == pytest.approx(exact.scale * np.exp(1j * exact.yaw))
        assert shift == pytest.approx(exact.x + 1j * exact.y)


def test_the_error_never_rises():
    """The theorem of Besl and McKay, section IV: the mean square distance never rises."""
    target, source, _ = crisp_pair()
    ended = []
    for iterations in range(1, 8):
        method = Icp(rotations=4, shifts=2, points=60, iterations=iterations, least_fall=1e-12)
        errors = method._ended(method.describe(target), method.describe(source), 1.0)[2]
        ended.append(errors)
    assert all((after <= before + 1e-9).all() for before, after in pairwise(ended))
    assert (ended[-1] < ended[0]).any()


def test_nothing_is_found_without_walls():
    target, _, _ = crisp_pair()
    method = Icp()
    maps = method.describe(target), method.describe(blank())
    assert method.propose(*maps, ScaleRange.known(), np.random.default_rng(0)) == ()
    assert method.published(*maps, ScaleRange.known(), np.random.default_rng(0)).target_from_source is None


@pytest.mark.parametrize(("field", "value"), [("rotations", 0), ("most_rms_cells", 0.0)])
def test_a_bad_setting_is_named(field, value):
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        Icp(**{field: value})
