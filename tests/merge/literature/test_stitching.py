import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.literature.stitching import Stitching
from merge.preparation.prepared_map import PreparedMap
from tests.merge.literature.crisp import blank, crisp_pair, off_share
from tests.merge.rooms import rooms


def published(method, target, source, seed=0, scale=None):
    maps = method.describe(target), method.describe(source)
    return method.published(*maps, scale or ScaleRange.free(), np.random.default_rng(seed))


def test_a_crisp_pair_is_found_and_the_confidence_is_opencvs():
    target, source, truth = crisp_pair(1.0, 5)
    answer = published(Stitching(), target, source)
    assert answer.verdict.accepted
    assert off_share(answer.target_from_source, truth, source) < 0.01
    method = Stitching()
    stitched = method._stitched(method.describe(target), method.describe(source), np.random.default_rng(0))
    inliers = stitched.matches.inliers
    assert stitched.confidence == pytest.approx(inliers.sum() / (8 + 0.3 * len(inliers)))
    assert answer.verdict.confidence == pytest.approx(stitched.confidence / (1 + stitched.confidence))


def test_proposals_keep_to_the_scale():
    target, source, truth = crisp_pair(1.3)
    method = Stitching()
    maps = method.describe(target), method.describe(source)
    (proposal,) = method.propose(*maps, ScaleRange(1.3, 1.3), np.random.default_rng(0))
    assert proposal.target_from_source.scale == 1.3
    assert off_share(proposal.target_from_source, truth, source) < 0.02


def test_points_of_opencv_are_converted_to_cells():
    values = np.where(rooms(np.random.default_rng(11)).walls, 100, 0)
    prepared_maps = [
        PreparedMap(OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), one.shape), one))
        for one in (np.rot90(values, -1), values)
    ]
    answer = published(Stitching(), *prepared_maps)
    truth = Similarity2(float(values.shape[0]), 0.0, np.pi / 2)  # rows up: counter-clockwise
    assert np.abs(answer.target_from_source.matrix() - truth.matrix()).max() < 0.2


def test_the_result_depends_on_the_seed():
    target, source, _ = crisp_pair()
    answers = [published(Stitching(), target, source, seed).target_from_source for seed in (0, 0, 1)]
    assert answers[0] == answers[1] != answers[2]


def test_below_its_confidence_the_answer_is_refused():
    target, source, _ = crisp_pair(1.0, 5)
    answer = published(Stitching(confidence=50.0), target, source)
    assert not answer.verdict.accepted
    assert "OpenCV's confidence is" in str(answer.verdict.refusal)


def test_nothing_is_found_on_a_blank_map():
    target, _, _ = crisp_pair()
    method = Stitching()
    for other in (blank(), blank(5, 7)):
        maps = method.describe(target), method.describe(other)
        assert method.propose(*maps, ScaleRange.free(), np.random.default_rng(0)) == ()
        assert published(method, target, other).target_from_source is None


@pytest.mark.parametrize(("field", "value"), [("confidence", 0.0), ("match_confidence", 1.0), ("least_matches", 2)])
def test_a_bad_setting_is_named(field, value):
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        Stitching(**{field: value})
