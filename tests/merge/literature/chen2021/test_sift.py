import numpy as np
import pytest
from scipy import ndimage

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.literature.chen2021.sift import Sift, _picture
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.keypoints import match_descriptors
from tests.merge.rooms import rooms


@pytest.fixture(scope="module")
def world():
    walls = rooms(np.random.default_rng(11)).walls
    return np.where(walls, 100, 0)


def prepare(values):
    return PreparedMap(OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), values.shape), values))


@pytest.mark.parametrize("feature", ["sift", "orb"])
def test_a_rotation_is_proposed_first_and_to_a_fraction_of_a_cell(world, feature):
    method, turned = Sift(feature), np.rot90(world, -1)  # rows up: counter-clockwise
    target, source = method.describe(prepare(turned)), method.describe(prepare(world))
    best = method.propose(target, source, ScaleRange.free(), np.random.default_rng(0))[0]
    truth = Similarity2(float(world.shape[0]), 0.0, np.pi / 2)
    assert np.abs(best.target_from_source.matrix() - truth.matrix()).max() < (0.2 if feature == "sift" else 0.8)


def test_a_world_of_half_the_cell_size_has_scale_one_half(world):
    method, fine = Sift(), np.kron(world, np.ones((2, 2), dtype=int))
    target, source = method.describe(prepare(world)), method.describe(prepare(fine))
    best = method.propose(target, source, ScaleRange.free(), np.random.default_rng(0))[0]
    assert best.target_from_source.scale == pytest.approx(0.5, rel=5e-3)


@pytest.mark.parametrize("feature", ["sift", "orb"])
def test_as_published_the_answer_is_that_of_one_sample_and_its_index_the_confidence(world, feature):
    method, turned = Sift.as_published(feature), np.rot90(world, -1)
    target, source = method.describe(prepare(turned)), method.describe(prepare(world))
    answer = method.published(target, source, ScaleRange.known(), np.random.default_rng(0))
    truth = Similarity2(float(world.shape[0]), 0.0, np.pi / 2)
    here = method.matched(target, source)[1]
    assert np.abs(answer.target_from_source.apply(here) - truth.apply(here)).max() < 6.0
    assert answer.target_from_source.scale != 1.0  # free, whatever the range
    assert answer.verdict.accepted
    assert 0.9 < answer.verdict.confidence <= 1.0


def test_brisk_describes_fast_corners_by_bits_and_matches_a_map_with_itself():
    blobs = ndimage.gaussian_filter(np.random.default_rng(3).normal(size=(200, 260)), 3.0) > 0.05
    method = Sift.as_published("fast_brisk")
    found = method.describe(prepare(np.where(blobs, 100, 0)))
    assert found.descriptors.dtype == np.uint8
    there, here = method.matched(found, found)
    assert len(there) > 10
    assert np.array_equal(there, here)


def test_greys_are_one_a_probability_three_or_two(world):
    log_odds = np.where(world == 100, 1.0, np.linspace(-3.0, -1.0, world.shape[1])).astype(np.float32)
    log_odds[:, :9] = 0.0
    grid = OccupancyGrid(GridFrame(1.0, SE2(), world.shape), log_odds)
    pictures = {greys: _picture(grid, greys)[::-1] for greys in ("three", "two", "all")}
    assert set(np.unique(pictures["three"])) == {0, 128, 255}
    assert set(np.unique(pictures["two"])) == {0, 255}
    assert np.array_equal(pictures["two"] == 0, grid.occupied)
    free = 255 / (1 + np.exp(log_odds))
    assert np.abs(pictures["all"] - free)[grid.known].max() <= 0.5
    assert (pictures["all"][~grid.known] == 128).all()


def test_the_ratio_test_by_hand():
    target = np.array([[0.0, 0.0], [10.0, 0.0]], dtype=np.float32)
    source = np.array([[1.0, 0.0], [4.5, 0.0], [9.0, 0.0]], dtype=np.float32)  # ratios 1/9, 4.5/5.5 and 1/9
    to, of = match_descriptors(target, source, 0.8)
    assert (to.tolist(), of.tolist()) == ([0, 1], [0, 2])
    assert match_descriptors(target, source, 0.83)[1].tolist() == [0, 1, 2]


@pytest.mark.parametrize("feature", ["sift", "orb"])
def test_a_blank_map_has_no_features_and_no_proposals(world, feature):
    method = Sift(feature)
    blank, full = method.describe(prepare(np.zeros((40, 40), dtype=int))), method.describe(prepare(world))
    assert len(blank.points) == 0
    for target, source in ((blank, full), (full, blank), (blank, blank)):
        assert method.propose(target, source, ScaleRange.free(), np.random.default_rng(0)) == ()
        answer = method.published(target, source, ScaleRange.free(), np.random.default_rng(0))
        assert answer.target_from_source is None


@pytest.mark.parametrize(
    ("field", "value"),
    [
        *(("ratio", -0.5), ("ratio", 1.5), ("smoothing_cells", -1.0), ("most_features", 0)),
        *(("feature", "surf"), ("greys", "four")),
    ],
)
def test_a_bad_setting_is_named(field, value):
    with pytest.raises(ValueError, match=f"{field} is {value!r}"):
        Sift(**{field: value})
