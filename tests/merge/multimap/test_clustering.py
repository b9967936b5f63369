"""Clusters of maps from right and wrong answers without cells: cycle consistency only."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.similarity2 import Similarity2
from merge.multimap.clustering import cluster_maps
from merge.multimap.graph import ConsistencyModel, Edge
from merge.multimap.outlier_rejection import total_log_odds
from merge.multimap.pose_graph import leave_one_out_residuals
from tests.merge.rooms import random_similarity

DEVIATIONS = np.array([1.0, 1.0, 0.01, 0.01])


def silent(target, source, place):
    return 0.0


def consistent(number, edges, likelihood, fixed_scale):
    return cluster_maps(number, edges, ConsistencyModel(likelihood, fixed_scale))


def world(number, seed):
    rng = np.random.default_rng(seed)
    return [random_similarity(rng, (0.6, 1.6)) for _ in range(number)], rng


def edge(poses, a, b, rng, wrong=False, weight=3.0):
    truth = poses[a].inverse() @ poses[b]
    move = DEVIATIONS * rng.standard_normal(4)
    if wrong:
        move = np.array([*rng.uniform(30, 60, 2), rng.uniform(0.5, 3.0), 0.0])
    found = Similarity2(truth.x + move[0], truth.y + move[1], truth.yaw + move[2], truth.scale * math.exp(move[3]))
    return Edge(a, b, found, np.diag(DEVIATIONS**2), weight)


def all_edges(poses, rng, wrong=()):
    number = len(poses)
    return [edge(poses, a, b, rng, (a, b) in wrong) for a in range(number) for b in range(a + 1, number)]


def check_poses(group, poses, off=4.0):
    for index in group.poses:
        truth = poses[group.root].inverse() @ poses[index]
        found = group.target_from_source(group.root, index)
        assert math.hypot(found.x - truth.x, found.y - truth.y) < off * max(1.0, truth.scale)
        assert abs(math.remainder(found.yaw - truth.yaw, math.tau)) < 0.04


def ends(edges):
    return {(e.target, e.source) for e in edges}


@given(st.integers(0, 10_000), st.integers(4, 9))
@settings(max_examples=15, deadline=None)
def test_wrong_answers_among_many_are_rejected_and_no_map_is_lost(seed, number):
    poses, rng = world(number, seed)
    pairs = [(a, b) for a in range(number) for b in range(a + 1, number)]
    wrong = {pairs[k] for k in rng.permutation(len(pairs))[: int(0.3 * len(pairs))]}
    held = [p for p in pairs if p not in wrong]
    if min(sum(k in p for p in held) for k in range(number)) < 3:
        return
    (group,) = consistent(number, all_edges(poses, rng, wrong), silent, fixed_scale=False)
    assert not ends(group.edges) & wrong
    assert len(ends(group.edges)) >= len(held) - 1  # one right answer in a thousand may lie past the gate
    check_poses(group, poses)


def test_one_wrong_answer_in_a_cycle_with_a_chord_is_found():
    poses, rng = world(6, 1)
    ring = [(k, (k + 1) % 6) for k in range(6)]
    edges = [edge(poses, *pair, rng) for pair in [*ring, (0, 3), (1, 4)]]
    edges.append(edge(poses, 2, 5, rng, wrong=True, weight=4.0))
    (group,) = consistent(6, edges, silent, fixed_scale=False)
    assert (2, 5) not in ends(group.edges)
    assert len(group.edges) == 8
    check_poses(group, poses)


def test_cells_decide_an_ambiguous_triangle():
    """The most confident of three answers is wrong, which only the cells reveal."""
    poses, rng = world(3, 3)
    edges = [
        edge(poses, 0, 1, rng, weight=2.0),
        edge(poses, 1, 2, rng, weight=2.0),
        edge(poses, 0, 2, rng, wrong=True, weight=4.0),
    ]

    def truthful(target, source, place):
        truth = poses[target].inverse() @ poses[source]
        return 2.0 if math.hypot(place.x - truth.x, place.y - truth.y) < 10.0 else -3.0

    (group,) = consistent(3, edges, truthful, fixed_scale=False)
    assert ends(group.edges) == {(0, 1), (1, 2)}


def test_maps_without_answers_are_separate_clusters():
    poses, rng = world(6, 2)
    groups = consistent(6, [edge(poses, 0, 3, rng), edge(poses, 1, 4, rng), edge(poses, 4, 5, rng)], silent, False)
    assert [sorted(group.poses) for group in groups] == [[0, 3], [1, 4, 5], [2]]


def test_clusters_that_contradict_in_their_cells_are_not_joined():
    poses, rng = world(3, 4)
    edges = [edge(poses, 0, 1, rng), edge(poses, 1, 2, rng, wrong=True, weight=1.0)]

    def contradicting(target, source, place):
        return -3.0 if {target, source} == {0, 2} else 0.0

    assert [sorted(g.poses) for g in consistent(3, edges, contradicting, False)] == [[0, 1], [2]]


@pytest.mark.parametrize("wrong", [False, True])
def test_cells_that_look_alike_join_no_clusters_of_a_large_team(wrong):
    """Of two parts that look alike the cells of every pair agree: the answer between them has to be sure enough."""
    poses, rng = world(6, 0)
    parts = [edge(poses, a, b, rng) for part in ((0, 1, 2), (3, 4, 5)) for a in part for b in part if a < b]

    def joined(log_odds, cells_join):
        edges = [*parts, edge(poses, 1, 4, rng, wrong, log_odds)]
        model = ConsistencyModel(lambda target, source, place: 2.0, True, cells_join=cells_join)
        return len(cluster_maps(6, edges, model)) == 1

    assert joined(-0.4, cells_join=True)
    assert not joined(-0.4, cells_join=False)
    assert joined(0.4, cells_join=False)


@pytest.mark.parametrize("cells_join", [True, False])
def test_cells_that_look_alike_shift_no_map_of_a_large_team(cells_join):
    """The cells of all maps agree with a wrong answer that is not sure enough, and are silent at the right place."""
    poses, rng = world(5, 1)
    wrong = edge(poses, 1, 4, rng, wrong=True, weight=-0.4)
    shifted = poses[1] @ wrong.target_from_source
    rest = [edge(poses, a, b, rng) for a in range(4) for b in range(a + 1, 4)]

    def alike(target, source, place):
        if 4 not in (target, source):
            return 0.0
        there = place if source == 4 else place.inverse()
        expected = poses[min(target, source)].inverse() @ shifted
        return 2.0 if math.hypot(there.x - expected.x, there.y - expected.y) < 8.0 else 0.0

    model = ConsistencyModel(alike, True, cells_join=cells_join)
    (found,) = cluster_maps(5, [*rest, edge(poses, 0, 4, rng, weight=1.0), wrong], model)
    place, truth = found.target_from_source(0, 4), poses[0].inverse() @ poses[4]
    assert (math.hypot(place.x - truth.x, place.y - truth.y) < 8.0) is not cells_join


def test_the_order_and_the_direction_of_answers_change_nothing():
    poses, rng = world(7, 5)
    edges = all_edges(poses, rng, {(0, 4), (2, 6), (1, 3)})
    (one,) = consistent(7, edges, silent, False)
    other_way = [e.reversed() for e in edges[::-1]]
    (other,) = consistent(7, other_way, silent, False)
    assert {frozenset(p) for p in ends(one.edges)} == {frozenset(p) for p in ends(other.edges)}
    for index in range(1, 7):
        a, b = one.target_from_source(0, index), other.target_from_source(0, index)
        np.testing.assert_allclose(a.matrix(), b.matrix(), atol=0.05)


def test_reversing_an_edge_twice_gives_the_edge():
    poses, rng = world(2, 6)
    one = edge(poses, 0, 1, rng)
    again = one.reversed().reversed()
    np.testing.assert_allclose(again.target_from_source.matrix(), one.target_from_source.matrix(), atol=1e-9)
    np.testing.assert_allclose(again.covariance, one.covariance, rtol=1e-6, atol=1e-9)


def test_many_answers_average_their_errors():
    errors = []
    for seed in range(8):
        poses, rng = world(6, 100 + seed)
        (group,) = consistent(6, all_edges(poses, rng), silent, False)
        truth, found = poses[0].inverse() @ poses[5], group.target_from_source(0, 5)
        errors.append(math.hypot(found.x - truth.x, found.y - truth.y))
    assert np.mean(errors) < 0.75 * math.sqrt(math.pi / 2.0)  # what one answer alone is off on average


def test_true_poses_have_larger_log_odds_than_others():
    poses, rng = world(5, 7)
    edges = all_edges(poses, rng, {(0, 1)})
    (group,) = consistent(5, edges, silent, False)
    shifted = dict(group.poses)
    shifted[4] = Similarity2(40.0, 0.0) @ shifted[4]
    worse = type(group)(shifted, group.edges)
    model = ConsistencyModel(silent, fixed_scale=False)
    assert total_log_odds([group], edges, model) > total_log_odds([worse], edges, model)


@pytest.mark.parametrize("fixed", [True, False])
def test_a_fixed_scale_is_kept(fixed):
    poses, rng = world(4, 8)
    poses = [Similarity2(p.x, p.y, p.yaw) for p in poses]
    edges = []
    for e in all_edges(poses, rng):
        found = e.target_from_source
        edges.append(dataclasses.replace(e, target_from_source=Similarity2(found.x, found.y, found.yaw)))
    (group,) = consistent(4, edges, silent, fixed)
    for index in range(4):
        assert group.target_from_source(0, index).scale == pytest.approx(1.0, abs=1e-9 if fixed else 0.02)


def test_a_slightly_wrong_answer_over_a_long_chain_is_rejected():
    """Its ends lie many right answers apart, which together give way until each of them, and it, passes; but what all
    the others say of its pair, they say too exactly for it."""
    number = 12
    poses, rng = world(number, 11)
    edges = [edge(poses, k, j, rng) for k in range(number) for j in (k + 1, k + 2) if j < number]
    truth = poses[0].inverse() @ poses[number - 1]
    along = math.hypot(truth.x, truth.y)
    near = Similarity2(truth.x + 9.0 * truth.x / along, truth.y + 9.0 * truth.y / along, truth.yaw, truth.scale)
    edges.append(Edge(0, number - 1, near, np.diag(3.0 * DEVIATIONS**2), 3.0))
    (group,) = consistent(number, edges, silent, False)
    squares = leave_one_out_residuals(group.poses, group.edges, group.root, False, 1e-6)
    assert len(group.poses) == number
    assert squares.max() < ConsistencyModel(silent, fixed_scale=False).gate


def test_a_confident_wrong_answer_excludes_no_map():
    poses, rng = world(3, 9)
    edges = [
        edge(poses, 0, 1, rng, wrong=True, weight=3.0),
        edge(poses, 0, 2, rng, weight=0.8),
        edge(poses, 1, 2, rng, weight=0.8),
    ]

    def cells(target, source, place):
        """Cells of the wrong pose say nothing, as if the maps hardly overlapped."""
        truth = poses[target].inverse() @ poses[source]
        if math.hypot(place.x - truth.x, place.y - truth.y) < 10.0:
            return 1.0
        return 0.0 if {target, source} == {0, 1} else -3.0

    (group,) = consistent(3, edges, cells, False)
    assert ends(group.edges) == {(0, 2), (1, 2)}
