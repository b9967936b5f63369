"""Disturbances of maps, and the truth after them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapquilt.benchmark.disturbance.footprints import TrueFootprints, with_footprints
from mapquilt.benchmark.disturbance.kinds import KINDS, DisturbedMap, warp
from mapquilt.benchmark.disturbance.settings import DisturbanceSettings
from mapquilt.benchmark.disturbance.truth import refitted_truth
from mapquilt.benchmark.disturbance.warp import moved_by, smooth_field, warp_field, without_similarity
from mapquilt.evaluation.evaluated_pair import GroundTruth
from tests.merge.literature.crisp import YAW, crisp_pair

TARGET, SOURCE = (part.grid for part in crisp_pair(1.3)[:2])
TRUTH = Similarity2(3.0, 1.0, -YAW, 1.0 / 1.3).inverse()
SETTINGS = DisturbanceSettings()
SEEDS = st.integers(0, 2**32 - 1)
FEW = hypothesis_settings(max_examples=10)
DRAWN_AGAIN = [kind for kind in KINDS if not kind.startswith("warp")]


def known(truth=TRUTH, **fields):
    return GroundTruth(truth, **{"overlap": 0.8, "residual_m": 0.0} | fields)


def values_at(grid, points):
    cells = grid.frame.cells_from_metres(points)
    return grid.log_odds[cells[:, 0], cells[:, 1]]


@FEW
@given(SEEDS)
def test_a_warp_of_nothing_moves_nothing(seed):
    done = warp(0.0)(SOURCE, SETTINGS, np.random.default_rng(seed))
    cells = np.argwhere(SOURCE.known)
    assert np.count_nonzero(done.grid.known) == len(cells)
    points = SOURCE.frame.metres_from_cells(cells)
    assert np.array_equal(values_at(done.grid, points), values_at(SOURCE, points))
    found = refitted_truth(known(), TARGET, done)
    assert np.allclose(found.target_from_source.matrix(), TRUTH.matrix(), atol=1e-9)
    assert found.residual_m < 1e-9


@FEW
@given(SEEDS, st.sampled_from([0.01, 0.02, 0.03]))
def test_a_warp_is_as_large_as_its_name_and_holds_no_similarity(seed, share):
    rng = np.random.default_rng(seed)
    field = warp_field(SOURCE, share, 0.4, rng)
    lengths = np.hypot(*field[SOURCE.known].T) * SOURCE.frame.resolution / SOURCE.known_diagonal
    assert np.quantile(lengths, 0.99) == pytest.approx(share, rel=1e-4)
    assert np.allclose(without_similarity(field, SOURCE.known), field, atol=1e-3)


@FEW
@given(SEEDS)
def test_cells_of_a_warp_come_to_lie_where_the_field_moves_them(seed):
    """The oracle moves each wall cell forwards; the map is drawn backwards."""
    done = warp(0.03)(SOURCE, SETTINGS, np.random.default_rng(seed))
    walls = np.argwhere(done.before.occupied)
    moved = np.rint(walls + done.moved[walls[:, 0], walls[:, 1]][:, ::-1]).astype(int)
    near = np.argwhere(done.grid.occupied)
    distances = np.array([np.abs(near - cell).max(axis=1).min() for cell in moved])
    assert (distances <= 1).mean() > 0.99


@FEW
@given(st.floats(-0.2, 0.2), st.floats(-8.0, 8.0), st.floats(-8.0, 8.0))
def test_the_truth_of_a_rigidly_moved_map_is_that_motion(turn, right, up):
    """A map that is turned and shifted in its own frame is laid back by the inverse."""
    wide = SOURCE.cropped(60)
    rows, cols = np.indices(wide.frame.shape)
    c, s = math.cos(turn), math.sin(turn)
    field = np.stack((c * cols - s * rows + right - cols, s * cols + c * rows + up - rows), axis=-1).astype(np.float32)
    found = refitted_truth(known(), TARGET, DisturbedMap(moved_by(wide, field), wide, field))
    corners = np.argwhere(SOURCE.occupied)[::50]
    cells = np.argwhere(wide.occupied)[::50]
    moved = wide.frame.metres_from_cells(cells + field[cells[:, 0], cells[:, 1]][:, ::-1])
    assert np.allclose(
        found.target_from_source.apply(moved), TRUTH.apply(SOURCE.frame.metres_from_cells(corners)), atol=1e-3
    )
    assert found.residual_m < 1e-3
    assert found.target_from_source.scale == pytest.approx(TRUTH.scale)


@FEW
@given(SEEDS)
def test_the_residual_of_a_warp_is_in_metres_of_the_world(seed):
    done = warp(0.02)(SOURCE, SETTINGS, np.random.default_rng(seed))
    once, thrice = (refitted_truth(known(target_scale=scale), TARGET, done) for scale in (1.0, 3.0))
    largest = 0.03 * SOURCE.known_diagonal * TRUTH.scale
    assert 0.0 < once.residual_m < largest
    assert thrice.residual_m == pytest.approx(3.0 * once.residual_m)
    before = refitted_truth(known(residual_m=0.5), TARGET, done)
    assert before.residual_m == pytest.approx(math.hypot(0.5, once.residual_m))


@FEW
@given(SEEDS, st.sampled_from(DRAWN_AGAIN))
def test_cells_that_stay_keep_their_frame_and_their_truth(seed, kind):
    done = KINDS[kind](SOURCE, SETTINGS, np.random.default_rng(seed))
    assert done.grid.frame == SOURCE.frame
    assert refitted_truth(known(), TARGET, done) == known()


def test_what_each_kind_changes():
    """Specks turn few cells over; walls only grow; crops and gaps only forget; furniture leaves all walls."""
    done = {kind: KINDS[kind](SOURCE, SETTINGS, np.random.default_rng(5)).grid for kind in DRAWN_AGAIN}
    changed = done["specks"].log_odds != SOURCE.log_odds
    assert 0.001 < changed.sum() / SOURCE.known.sum() < 0.01
    assert np.array_equal(done["specks"].known, SOURCE.known)
    assert (done["thick-walls"].occupied >= SOURCE.occupied).all()
    assert np.array_equal(done["furniture"].occupied[SOURCE.occupied], SOURCE.occupied[SOURCE.occupied])
    assert (done["furniture"].occupied & SOURCE.free).any()
    for kind, (low, high) in {"crop": SETTINGS.kept_share, "gaps": (0.5, 0.8)}.items():
        kept = done[kind].known
        assert np.array_equal(done[kind].log_odds[kept], SOURCE.log_odds[kept])
        assert low - 0.01 <= kept.sum() / SOURCE.known.sum() <= high + 0.01


def without(grid, lost):
    return OccupancyGrid(grid.frame, np.where(lost, 0.0, grid.log_odds))


def rows_above(row):
    return np.arange(TARGET.frame.shape[0])[:, None] > row


def after(target, lost):
    """The footprints of a target and of a source that lost cells, both in the frame of the target, as the world is."""
    done = DisturbedMap(without(TARGET, lost), TARGET)
    return TrueFootprints(target, TARGET, Similarity2.identity()).after(done)


def test_overlap_follows_what_is_lost():
    """The oracle counts cells of maps whose transform is the identity."""
    middle, quarter = np.quantile(np.argwhere(TARGET.known)[:, 0], (0.5, 0.25))
    assert after(TARGET, rows_above(middle)).overlap == 1.0
    low = without(TARGET, rows_above(middle))
    assert after(low, rows_above(quarter)).overlap == 1.0
    high = without(TARGET, ~rows_above(quarter))
    kept = low.known & high.known
    assert after(high, rows_above(middle)).overlap == kept.sum() / min(low.known.sum(), high.known.sum())
    nothing = with_footprints(known(), after(low, low.known))
    assert nothing.target_from_source is None and nothing.overlap == 0.0 and not nothing.identifiable


def test_a_piece_that_fits_elsewhere_is_not_identifiable():
    """Of the whole map a robot would know its place; of a few cells of one wall it would not."""
    whole = with_footprints(known(), after(TARGET, np.zeros(TARGET.frame.shape, bool)))
    assert whole.identifiable and whole.overlap == 1.0
    row, col = np.argwhere(TARGET.occupied)[40]
    near = np.zeros(TARGET.frame.shape, bool)
    near[max(0, row - 6) : row + 7, max(0, col - 6) : col + 7] = True
    assert not with_footprints(known(), after(TARGET, ~near)).identifiable


def test_a_negative_stays_one():
    done = KINDS["warp-3"](SOURCE, SETTINGS, np.random.default_rng(0))
    negative = GroundTruth(None, overlap=0.0)
    assert refitted_truth(negative, TARGET, done) == negative


def test_lengths_are_of_the_world():
    assert SETTINGS.stated_at(2.0).box_side == (0.15, 0.7)


@FEW
@given(SEEDS, st.sampled_from([3.0, 20.0, 80.0]))
def test_a_smooth_field_changes_little_between_neighbours(seed, reach):
    field = smooth_field((90, 130), reach, np.random.default_rng(seed))
    assert field.shape == (90, 130, 2)
    steps = max(float(np.abs(np.diff(field, axis=axis)).max()) for axis in (0, 1))
    assert steps * reach < 8.0 * float(np.ptp(field))
