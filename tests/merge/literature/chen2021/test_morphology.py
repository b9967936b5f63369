import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.literature.chen2021.corner_consensus import CornerMatch
from merge.literature.chen2021.morphology import Morphology, best_of_each_quadrant
from merge.preparation.prepared_map import PreparedMap
from tests.merge.literature.crisp import CELL, blank, crisp_pair, off_share
from tests.merge.rooms import cave, observed, viewpoints

RNG = np.random.default_rng(0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "scale"), [(1.0, ScaleRange.known()), (1.0, ScaleRange.free()), (1.6, ScaleRange.free())]
)
def test_the_first_proposal_and_the_answer_as_published_are_the_truth(size, scale):
    target, source, truth = crisp_pair(size)
    method = Morphology()
    maps = method.describe(target), method.describe(source)
    assert off_share(method.propose(*maps, scale, RNG)[0].target_from_source, truth, source) < 0.004
    answer = method.published(*maps, scale, RNG)
    assert off_share(answer.target_from_source, truth, source) < 0.004
    assert answer.verdict.accepted
    assert answer.verdict.confidence > 0.95
    assert answer.evidence is None


def test_without_icp_the_answer_is_the_fit_to_the_corners_and_without_consensus_a_sample():
    target, source, _ = crisp_pair()
    bare = Morphology(without="icp")
    maps = bare.describe(target), bare.describe(source)
    starts = [each.target_from_source for each in bare.agreed(*maps, ScaleRange.free())]
    assert bare.published(*maps, ScaleRange.free(), RNG).target_from_source in starts
    itself = Morphology(without="consensus").published(maps[1], maps[1], ScaleRange.free(), np.random.default_rng(0))
    assert itself.target_from_source.matrix() == pytest.approx(Similarity2().matrix(), abs=1e-6)


def test_the_result_is_deterministic():
    target, source, _ = crisp_pair()
    method = Morphology()
    maps = method.describe(target), method.describe(source)
    answers = [method.published(*maps, ScaleRange.free(), np.random.default_rng(seed)) for seed in (1, 2)]
    assert answers[0].target_from_source == answers[1].target_from_source


@pytest.mark.slow
def test_a_cave_has_no_main_direction_and_is_still_matched():
    rng = np.random.default_rng(5)
    world, source_from_world = cave(rng, 30.0, 26.0), Similarity2(3.0, 1.0, -0.9)
    views = viewpoints(world, rng, (8.0, 8.0), (22.0, 18.0))  # the straight outer walls lie out of sight
    grids = [observed(world, views, frame, rng) for frame in (Similarity2(), source_from_world)]
    cells = [Similarity2.from_se2(grid.frame.origin, CELL) for grid in grids]
    truth = cells[0].inverse() @ source_from_world.inverse() @ cells[1]
    method = Morphology()
    maps = tuple(method.describe(PreparedMap(grid)) for grid in grids)
    assert not any(one.correction.direction.clear for one in maps)
    best = [
        off_share(p.target_from_source, truth, PreparedMap(grids[1]))
        for p in method.propose(*maps, ScaleRange.known(), rng)
    ]
    assert min(best) < 0.01


def test_blank_maps_get_no_proposal_and_are_refused():
    method = Morphology()
    full, bare = method.describe(crisp_pair()[0]), method.describe(blank())
    for maps in ((full, bare), (bare, full), (bare, bare)):
        assert method.propose(*maps, ScaleRange.free(), RNG) == ()
        assert not method.published(*maps, ScaleRange.free(), RNG).verdict.accepted


def test_the_first_of_each_quarter_is_kept():
    none = np.empty(0, np.intp)
    yaws = (0.1, 0.2, 1.6, -3.0, 0.05, -1.5)
    found = [CornerMatch(Similarity2(yaw=yaw), none, none, 0) for yaw in yaws]
    assert [one.target_from_source.yaw for one in best_of_each_quadrant(found)] == [0.1, 1.6, -3.0, -1.5]
    assert best_of_each_quadrant([]) == []


def test_a_bad_setting_is_named():
    with pytest.raises(ValueError, match="proposals is 0"):
        Morphology(proposals=0)
