"""Teams merged in full: order and workers change nothing, wrong answers are refused, refused ones recovered."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.jobs.runner import Runner, Workers
from merge import MergeSettings, merge_maps
from merge.merger import solve
from merge.multimap.graph import Cluster, in_matching_order
from merge.multimap.joint_icp import joint_icp, mean_score
from merge.multimap.pair_selection import best_partners, in_blocks
from merge.multimap.team import Team
from merge.multimap.verdicts import verdict_by_itself
from merge.records.prior import Prior
from merge.records.verdict import Reason, Refusal
from tests.merge.rooms import hall, observed, random_similarity, rooms, viewpoints
from tests.merge.test_merger import off_cells, team, two_maps


@pytest.fixture(scope="module")
def three():
    maps, frames = team(8, 3)
    return maps, frames, merge_maps(maps)


def permuted(maps: MapSet, order) -> MapSet:
    def in_order(values):
        return tuple(values[k] for k in order)

    return MapSet(in_order(maps.names), in_order(maps.grids), in_order(maps.units), maps.resolutions_trusted)


@pytest.mark.slow
@pytest.mark.parametrize("order", [(2, 0, 1), (1, 0, 2)])
def test_the_order_of_the_maps_changes_only_the_frame(three, order):
    maps, _, before = three
    after = merge_maps(permuted(maps, order))
    assert (before.reference, after.reference) == (maps.names[0], maps.names[order[0]])
    after_from_before = before.reference_from_map[after.reference].inverse()
    for name, place in before.reference_from_map.items():
        expected = after_from_before @ place
        np.testing.assert_allclose(after.reference_from_map[name].matrix(), expected.matrix(), atol=1e-3)


@pytest.mark.slow
def test_the_number_of_workers_changes_no_byte(three):
    maps, _, alone = three
    with Runner(Workers(2)) as runner:
        shared = merge_maps(maps, runner=runner)
    assert shared.reference_from_map == alone.reference_from_map
    assert shared.merged.log_odds.tobytes() == alone.merged.log_odds.tobytes()
    for one, other in zip(shared.pairs, alone.pairs, strict=True):
        assert (one.target_from_source, one.evidence, one.confidence) == (
            other.target_from_source,
            other.evidence,
            other.confidence,
        )


def test_a_wrong_answer_is_refused_and_the_pair_recovered(three):
    """The most confident of three answers is wrong: the cells reveal it, and the others guide the new search."""
    maps, frames, before = three
    answers = {(p.target, p.source): p for p in before.pairs}
    right = answers["a", "c"]
    wrong = Similarity2(4.0, -3.0, 1.5) @ right.target_from_source
    answers["a", "c"] = dataclasses.replace(right, target_from_source=wrong, confidence=0.999)
    result = merge_maps(maps, answers=answers)
    pair = next(p for p in result.pairs if (p.target, p.source) == ("a", "c"))
    assert (pair.accepted, pair.decided_by) == (True, "team")
    truth = frames[0] @ frames[2].inverse()
    assert off_cells(pair.target_from_source, truth, maps.grids[2]) < 1.0
    assert result.left_out == {}


def test_a_refused_pair_is_recovered_and_keeps_its_reason(three):
    maps, frames, before = three
    answers = {(p.target, p.source): p for p in before.pairs}
    answers["b", "c"] = dataclasses.replace(
        answers["b", "c"], accepted=False, refusal=Refusal(Reason.AMBIGUOUS), confidence=0.3
    )
    result = merge_maps(maps, answers=answers)
    pair = result.pairs[2]
    assert (pair.accepted, pair.decided_by, pair.pair_refusal) == (True, "team", Refusal(Reason.AMBIGUOUS))
    assert off_cells(pair.target_from_source, frames[1] @ frames[2].inverse(), maps.grids[2]) < 1.0
    again = verdict_by_itself(pair)
    assert (again.accepted, again.reason) == (False, Reason.AMBIGUOUS)


def test_a_pair_won_back_is_never_surer_than_the_bridge_that_placed_it(three):
    """Two storeys look alike: every pair across them agrees, but all stand on one doubtful pair."""
    maps, _, before = three
    answers = with_refused(before, [("b", "c")], {})
    answers["a", "c"] = dataclasses.replace(answers["a", "c"], confidence=0.64)
    pair = merge_maps(maps, answers=answers).pairs[2]
    assert (pair.accepted, pair.decided_by) == (True, "team")
    assert pair.confidence == 0.64


def with_refused(before, refused, moves):
    """The answers of a result, those pairs refused; where there is a move for one, found elsewhere."""
    answers = {(p.target, p.source): verdict_by_itself(p) for p in before.pairs}
    for pair in refused:
        found = moves.get(pair, Similarity2()) @ answers[pair].target_from_source
        answers[pair] = dataclasses.replace(
            answers[pair],
            accepted=False,
            confidence=0.3,
            refusal=Refusal(Reason.AMBIGUOUS),
            target_from_source=found,
            alternatives=(),
        )
    return answers


def test_a_map_is_recovered_if_two_refused_answers_agree(three):
    maps, frames, before = three
    answers = with_refused(before, [("a", "c"), ("b", "c")], {})
    result = merge_maps(maps, answers=answers)
    assert result.left_out == {}
    for k, pair in ((0, result.pairs[1]), (1, result.pairs[2])):
        assert (pair.accepted, pair.decided_by, pair.pair_refusal) == (True, "team", Refusal(Reason.AMBIGUOUS))
        assert off_cells(pair.target_from_source, frames[k] @ frames[2].inverse(), maps.grids[2]) < 1.0


def test_refused_answers_that_disagree_recover_no_map(three):
    maps, _, before = three
    moves = {("b", "c"): Similarity2(3.0, -2.0, 1.0)}
    result = merge_maps(maps, answers=with_refused(before, [("a", "c"), ("b", "c")], moves))
    assert set(result.left_out) == {"c"} or set(result.left_out) == {"a", "b"}
    assert [pair.reason for pair in result.pairs[1:]] == [Reason.AMBIGUOUS, Reason.AMBIGUOUS]


def test_refused_answers_that_agree_on_a_wrong_pose_recover_no_map(three):
    """Both place c three metres off; the merged map of a and b contradicts them."""
    maps, frames, before = three
    shift = Similarity2(3.0, -2.0)
    moves = {
        ("a", "c"): frames[0] @ shift @ frames[0].inverse(),
        ("b", "c"): frames[1] @ shift @ frames[1].inverse(),
    }
    result = merge_maps(maps, answers=with_refused(before, [("a", "c"), ("b", "c")], moves))
    assert not any(pair.accepted for pair in result.pairs[1:])


def test_an_answer_that_the_team_refused_is_accepted_by_itself(three):
    pair = dataclasses.replace(
        three[2].pairs[0], accepted=False, refusal=Refusal(Reason.CONTRADICTS_TEAM), decided_by="team"
    )
    again = verdict_by_itself(pair)
    assert (again.accepted, again.reason, again.decided_by) == (True, None, "pair")
    assert again.target_from_source == three[2].pairs[0].target_from_source


def test_joint_icp_corrects_small_pose_errors(three):
    maps, frames, _ = three
    solved = Team.of(maps, MergeSettings())
    (group,) = solve(solved, {}).clusters
    prepared = solved.likelihood.prepared
    rng = np.random.default_rng(0)
    poses = {
        index: Similarity2(*rng.uniform(-2, 2, 2), rng.uniform(-0.01, 0.01)) @ pose if index != group.root else pose
        for index, pose in group.poses.items()
    }
    refined = joint_icp(Cluster(poses, group.edges), prepared, {}, fixed_scale=True)
    assert mean_score(refined, prepared, 1500) > mean_score(Cluster(poses, group.edges), prepared, 1500)
    names = solved.maps.names
    for name in names[1:]:
        truth = frames["abc".index(names[0])] @ frames["abc".index(name)].inverse()
        found = solved.metric(refined, names[0], name)
        assert off_cells(found, truth, maps.grids["abc".index(name)]) < 1.0


def test_the_reference_can_be_chosen(three):
    maps, _, before = three
    name = next(name for name in maps.names if name != before.reference)
    result = merge_maps(maps, MergeSettings(reference=name))
    assert result.reference == name
    for other, place in before.reference_from_map.items():
        expected = before.reference_from_map[name].inverse() @ place
        np.testing.assert_allclose(result.reference_from_map[other].matrix(), expected.matrix(), atol=1e-6)
    assert result.merged.frame.origin.yaw == maps.grids[maps.names.index(name)].frame.origin.yaw


def test_unknown_map_names_are_refused(three):
    with pytest.raises(ValueError, match="reference is 'x', must be the name of a map: a, b, c"):
        merge_maps(three[0], MergeSettings(reference="x"))
    with pytest.raises(ValueError, match="prior is 'y'"):
        merge_maps(three[0], MergeSettings(priors=(Prior("a", 0, 0, 0), Prior("y", 0, 0, 0))))


@pytest.mark.slow
def test_a_prior_resolves_a_symmetric_hall():
    maps, truth = two_maps(hall(), 0, [((0.3, 0.3), (13.7, 8.7))] * 2)
    assert not merge_maps(maps).pairs[0].accepted
    place = Prior("b", truth.x + 0.3, truth.y - 0.4, truth.yaw + 0.05, 1.0)
    settings = MergeSettings(reference="a", priors=(place,))
    (pair,) = merge_maps(maps, settings).pairs
    assert (pair.accepted, pair.decided_by) == (True, "prior")
    assert off_cells(pair.target_from_source, truth, maps.grids[1]) < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("reference", ["a", "b"])
def test_a_prior_resolves_a_symmetric_hall_of_unknown_scale(reference):
    """Map b states a resolution of 0.031 m, and has one of 0.05 m."""
    maps, truth = two_maps(hall(), 0, [((0.3, 0.3), (13.7, 8.7))] * 2)
    grid, shrunk = maps.grids[1], Similarity2(scale=1.0 / 1.6)
    origin = grid.frame.origin
    frame = GridFrame(grid.frame.resolution / 1.6, SE2(origin.x / 1.6, origin.y / 1.6, origin.yaw), grid.frame.shape)
    shrunk_grid = OccupancyGrid(frame, grid.log_odds)
    maps, truth = MapSet(("a", "b"), (maps.grids[0], shrunk_grid), ("m", "m"), False), truth @ shrunk.inverse()
    assert not merge_maps(maps).pairs[0].accepted
    true = truth if reference == "a" else truth.inverse()
    place = Prior("b" if reference == "a" else "a", true.x, true.y, true.yaw, 0.05)
    (pair,) = merge_maps(maps, MergeSettings(reference=reference, priors=(place,))).pairs
    assert (pair.accepted, pair.decided_by) == (True, "prior")
    assert off_cells(pair.target_from_source, truth, maps.grids[1]) < 1.5


def test_a_place_outside_of_the_priors_is_never_reported(three):
    maps, _, before = three
    found = before.pairs[0].target_from_source
    priors = (Prior("a", 0, 0, 0), Prior("b", found.x + 30.0, found.y, found.yaw, 0.5))
    two, settings = permuted(maps, (0, 1)), MergeSettings(priors=priors)
    result = merge_maps(two, settings)
    (pair,) = result.pairs
    assert (pair.accepted, pair.decided_by, len(result.groups)) == (False, "prior", 2)
    allows = Team.of(two, settings).expected["a", "b"].allows
    assert not allows(found)
    assert pair.target_from_source is None or allows(pair.target_from_source)
    assert all(allows(other.target_from_source) for other in pair.alternatives)


def test_maps_are_not_joined_by_others_against_a_prior(three):
    """Both a and b fit c; but the prior says that a and b lie 30 m apart."""
    maps, _, before = three
    found = before.pairs[0].target_from_source
    priors = (Prior("a", 0, 0, 0), Prior("b", found.x + 30.0, found.y, found.yaw, 0.5))
    result = merge_maps(maps, MergeSettings(priors=priors))
    assert not any({"a", "b"} <= group.reference_from_map.keys() for group in result.groups)
    assert any("c" in group.reference_from_map and len(group.reference_from_map) == 2 for group in result.groups)
    assert "the maps fit 30.0 m and 0 degrees from there" in str(result.pairs[0].refusal)


def test_trusted_priors_stitch_maps_that_share_nothing():
    grids = tuple(place(seed) for seed in (1, 2, 3))
    maps = MapSet(("a", "b", "c"), grids, ("m",) * 3, resolutions_trusted=False)
    start = Prior("b", 20.0, -3.0, 0.5)
    result = merge_maps(maps, MergeSettings(priors=(start,), trust_priors=True, reference="a"))
    np.testing.assert_allclose(result.reference_from_map["b"].matrix(), start.common_from_map.matrix(), atol=1e-9)
    np.testing.assert_allclose(result.reference_from_map["c"].matrix(), Similarity2().matrix(), atol=1e-9)
    for pair in result.pairs:
        assert (pair.accepted, pair.decided_by, pair.verified, pair.confidence) == (True, "trusted_prior", False, 0.0)
    np.testing.assert_allclose(
        result.pairs[2].target_from_source.matrix(), start.common_from_map.inverse().matrix(), atol=1e-12
    )


def test_a_map_without_metres_cannot_be_stitched(three):
    maps = dataclasses.replace(three[0], units=("m", "cell", "m"))
    with pytest.raises(ValueError, match="trust_priors: b states no resolution"):
        merge_maps(maps, MergeSettings(trust_priors=True))


def place(seed: int) -> OccupancyGrid:
    rng = np.random.default_rng(1000 + seed)
    world = rooms(rng, 7.0, 6.0)
    points = viewpoints(world, rng, (0.3, 0.3), (6.7, 5.7), number=6)
    return observed(world, points, random_similarity(rng), rng, 0.1, noise=0.01)


@pytest.mark.slow
def test_twenty_maps_of_twenty_places_are_not_joined():
    grids = tuple(place(seed) for seed in range(20))
    ticks: list[tuple[int, int]] = []
    names = tuple(f"map_{k}" for k in range(20))
    maps = MapSet(names, grids, ("m",) * 20)
    result = merge_maps(maps, MergeSettings("orb"), on_progress=lambda *counts: ticks.append(counts))
    assert len(result.groups) == 20
    assert len(result.left_out) == 19
    assert len(result.pairs) == 190
    assert not any(pair.accepted for pair in result.pairs)
    assert all(result.left_out.values())
    assert ticks[-1][0] == ticks[-1][1]
    assert all(later[0] > earlier[0] for earlier, later in itertools.pairwise(ticks))


def test_a_map_inside_another_joins_it_without_changing_the_frame():
    maps, _ = team(3)
    whole = maps.grids[0]
    rows, cols = np.nonzero(whole.known)
    low, left = rows.min() + 40, cols.min() + 40
    box = whole.log_odds[low : low + 150, left : left + 170]
    move = SE2(3.0, -2.0, 0.7)
    window = whole.frame.window((int(low), int(left)), box.shape)
    inside = OccupancyGrid(dataclasses.replace(window, origin=move @ window.origin), box)
    result = merge_maps(MapSet(("whole", "inside"), (whole, inside), ("m", "m")))
    assert result.left_out == {}
    assert result.reference == "whole"
    assert result.merged.frame == whole.cropped().frame
    truth = Similarity2.from_se2(move.inverse())
    assert off_cells(result.reference_from_map["inside"], truth, inside) < 0.5


def test_two_copies_of_one_map_coincide(three):
    grid = three[0].grids[0]
    result = merge_maps(MapSet(("one", "other"), (grid, grid), ("m", "m")))
    assert result.left_out == {}
    np.testing.assert_array_equal(result.merged.occupancy(), grid.cropped().occupancy())
    assert not result.groups[0].conflicts.occupied.any()


@pytest.mark.slow
def test_each_cluster_gets_a_merged_map(three):
    maps, _, _ = three
    others, _ = team(21, 2)
    names = ("a", "p", "b", "q")
    grids = (maps.grids[0], others.grids[0], maps.grids[1], others.grids[1])
    result = merge_maps(MapSet(names, grids, ("m",) * 4))
    assert sorted(sorted(group.reference_from_map) for group in result.groups) == [["a", "b"], ["p", "q"]]
    outside = set(names) - set(result.reference_from_map)
    assert set(result.left_out) == outside
    assert all("joined with" in reason for reason in result.left_out.values())
    asked = merge_maps(MapSet(names, grids, ("m",) * 4), MergeSettings(reference="q"))
    assert asked.reference == "q"
    for group in result.groups:
        assert group.merged.frame == group.conflicts.frame


def test_the_best_partners_of_each_map_are_selected():
    likelihoods = np.array([[0, 9, 8, 1], [9, 0, 7, 2], [8, 7, 0, 3], [1, 2, 3, 0]], float)
    pairs = [(a, b) for a in range(4) for b in range(a + 1, 4)]
    assert best_partners(likelihoods, pairs, 1) == [(0, 1), (0, 2), (2, 3)]
    assert best_partners(likelihoods, pairs, 3) == pairs


def test_blocks_and_their_order_contain_every_pair():
    pairs = [(a, b) for a in range(23) for b in range(a + 1, 23) if (a * b) % 5]
    assert sorted(pair for block in in_blocks(pairs, 10) for pair in block) == pairs
    assert max(len({k for pair in block for k in pair}) for block in in_blocks(pairs, 10)) <= 20
    assert sorted(in_matching_order(pairs)) == pairs
    assert in_matching_order([]) == []


def test_matching_order_keeps_maps_in_the_cache():
    """Maps in a ring in random order: a map is mostly among the last matched ones."""
    ring = np.random.default_rng(0).permutation(40).tolist()
    pairs = sorted(tuple(sorted((ring[k], ring[(k + j) % 40]))) for k in range(40) for j in (1, 2))

    def missed(order, kept=8):
        shelf: list[int] = []
        misses = 0
        for pair in order:
            for k in pair:
                misses += k not in shelf[-kept:]
                shelf = [*(other for other in shelf if other != k), k]
        return misses

    assert missed(in_matching_order(pairs)) < 0.7 * missed(pairs)


def test_merged_cells_are_as_fine_as_the_finest_map_if_resolutions_are_trusted():
    """The reference is the larger map, in cells twice as wide as those of the other."""
    rng = np.random.default_rng(0)
    world = rooms(rng, 16.0, 11.0)
    frames = [random_similarity(rng) for _ in range(2)]
    parts = (((0.3, 0.3), (15.0, 10.7)), ((4.5, 0.3), (12.0, 10.7)))
    grids = tuple(
        observed(world, viewpoints(world, rng, *part, number=25), frame, rng, resolution, noise=0.01)
        for part, frame, resolution in zip(parts, frames, (0.1, 0.05), strict=True)
    )
    result = merge_maps(MapSet(("large", "fine"), grids, ("m", "m")))
    assert (result.reference, result.left_out) == ("large", {})
    assert result.merged.frame.resolution == 0.05
    hidden = merge_maps(MapSet(("large", "fine"), grids, ("m", "m"), resolutions_trusted=False))
    assert hidden.merged.frame.resolution == 0.1
