import cv2
import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.literature.kaze_sift import KazeSift, in_sift_pyramid, unit_length
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.keypoints import Keypoints
from tests.merge.literature.crisp import blank, crisp_pair, off_share
from tests.merge.rooms import rooms


def published(method, target, source, seed=0):
    maps = method.describe(target), method.describe(source)
    return method.published(*maps, ScaleRange.free(), np.random.default_rng(seed))


@pytest.mark.parametrize("seed", [2, 5])
def test_a_crisp_pair_is_found(seed):
    target, source, truth = crisp_pair(1.0, seed)
    answer = published(KazeSift(), target, source)
    assert answer.verdict.accepted
    assert off_share(answer.target_from_source, truth, source) < 0.005


def test_the_confidence_is_the_share_of_inliers():
    target, source, _ = crisp_pair(1.0, 5)
    method = KazeSift()
    maps = method.describe(target), method.describe(source)
    answer = method.published(*maps, ScaleRange.free(), np.random.default_rng(0))
    there, here = method.matched(*maps)
    moved = answer.target_from_source.apply(maps[1].points[here])
    near = np.hypot(*(moved - maps[0].points[there]).T) <= method.inlier_distance_cells
    assert answer.verdict.confidence == pytest.approx(near.mean(), abs=0.05)
    assert len(set(there.tolist())) == len(there) == len(set(here.tolist()))


def test_a_map_turned_by_a_quarter_is_found_exactly():
    values = np.where(rooms(np.random.default_rng(11)).walls, 100, 0)
    target, source = (
        PreparedMap(OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), one.shape), one))
        for one in (np.rot90(values, -1), values)
    )
    answer = published(KazeSift(), target, source)
    truth = Similarity2(float(values.shape[0]), 0.0, np.pi / 2)  # rows up: counter-clockwise
    assert np.abs(answer.target_from_source.matrix() - truth.matrix()).max() < 0.2


def test_unknown_and_occupied_cells_are_one_colour():
    target, _, _ = crisp_pair()
    odds = np.where(target.grid.free, -1.0, 0.0).astype(np.float32)
    plain = PreparedMap(OccupancyGrid(target.grid.frame, odds))
    np.testing.assert_array_equal(KazeSift().describe(target).points, KazeSift().describe(plain).points)


def described(*vectors):
    return Keypoints(np.zeros((len(vectors), 2)), unit_length(np.array(vectors, np.float32)))


def test_matches_are_near_unique_and_both_ways():
    method = KazeSift()
    target = described((1, 0, 0), (0, 1, 0), (0, 0, 1))
    near, far, between = (1, 0.1, 0), (1, 0.3, 0), (1, 1, 0)
    assert [one.tolist() for one in method.matched(target, described(near, (0, 0.1, 1)))] == [[0, 2], [0, 1]]
    for other in (far, between):
        assert method.matched(target, described(other, (0, 0, -1)))[0].tolist() == []
    assert [one.tolist() for one in method.matched(target, described(near, (1, 0, 0.05)))] == [[0], [1]]
    assert method.matched(target, described(near, (1, 0, 0.09)))[0].tolist() == [], "the ratio bars the way back"


def test_a_keypoint_lies_in_the_layer_of_its_size():
    """OpenCV: octave in the first byte, layer in the second; blur doubles every three layers."""
    for size, octave, layer in (
        (3.2, 0, 0),
        (6.4, 1, 0),
        (3.2 * 2 ** (1 / 3), 0, 1),
        (12.8 * 2 ** (2 / 3), 2, 2),
        (1, 0, 0),
    ):
        placed = in_sift_pyramid(cv2.KeyPoint(3.0, 4.0, float(size), 30.0))
        assert (placed.octave & 255, placed.octave >> 8) == (octave, layer)
        assert (placed.pt, placed.angle) == ((3.0, 4.0), 30.0)


def test_proposals_keep_to_the_scale():
    target, source, truth = crisp_pair()
    method = KazeSift()
    maps = method.describe(target), method.describe(source)
    (proposal,) = method.propose(*maps, ScaleRange(1.0, 1.0), np.random.default_rng(0))
    assert proposal.target_from_source.scale == 1.0
    assert off_share(proposal.target_from_source, truth, source) < 0.005


def test_nothing_is_found_on_a_blank_map():
    target, _, _ = crisp_pair()
    method = KazeSift()
    for other in (blank(), blank(5, 7)):
        maps = method.describe(target), method.describe(other)
        assert method.propose(*maps, ScaleRange.free(), np.random.default_rng(0)) == ()
        assert published(method, target, other).target_from_source is None


@pytest.mark.parametrize(("field", "value"), [("ratio", 1.5), ("threshold", 0.0), ("samples", 0)])
def test_a_bad_setting_is_named(field, value):
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        KazeSift(**{field: value})
