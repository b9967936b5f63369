"""Alignments of two clusters, compared with a slow test of every two edges."""

from itertools import pairwise

import numpy as np
import pytest

from mapping.geometry.similarity2 import Similarity2
from merge.multimap.cluster_alignment import align_clusters
from merge.multimap.graph import Cluster, ConsistencyModel, hop_distances, is_connected
from tests.merge.multimap.test_clustering import DEVIATIONS, edge, ends, silent, world

MODEL = ConsistencyModel(silent, fixed_scale=False)


def groups_of(poses, rng):
    """0, 1, 2 in a row, and 3, 4, 5; where they truly lie."""

    def group(members):
        placed = {k: poses[members[0]].inverse() @ poses[k] for k in members}
        return Cluster(placed, tuple(edge(poses, a, b, rng) for a, b in pairwise(members)))

    return group((0, 1, 2)), group((3, 4, 5))


def slow_support(chosen, other, first, second):
    """Check if the other edge is consistent with this one's placement of the second cluster."""
    said = first.poses[chosen.target] @ chosen.target_from_source @ second.poses[chosen.source].inverse()
    predicted = first.poses[other.target].inverse() @ said @ second.poses[other.source]
    between = first.poses[other.target].inverse() @ first.poses[chosen.target]
    spot = between.apply([chosen.target_from_source.x, chosen.target_from_source.y])
    moved = Similarity2(*(spot - (predicted.x, predicted.y)), between.yaw, between.scale).adjoint()
    apart = (
        hop_distances(first, range(3))[other.target, chosen.target]
        + hop_distances(second, range(3, 6))[other.source - 3, chosen.source - 3]
    )
    slack = moved @ chosen.covariance @ moved.T + apart * other.covariance
    return other is chosen or MODEL.agrees(other, predicted, slack)


def test_the_best_alignment_has_the_most_support():
    for seed in range(20):
        poses, rng = world(6, seed)
        first, second = groups_of(poses, rng)
        pairs = [(a, b) for a in (0, 1, 2) for b in (3, 4, 5)]
        edges = [edge(poses, *pair, rng, wrong=rng.random() < 0.4, weight=rng.uniform(1.0, 3.0)) for pair in pairs]
        alignments = align_clusters(first, second, edges, MODEL)
        best = max(sum(o.log_odds for o in edges if slow_support(e, o, first, second)) for e in edges)
        assert alignments[0].support == pytest.approx(best)
        chosen = alignments[0].edges
        assert any(
            {id(o) for o in edges if slow_support(e, o, first, second)} == {id(o) for o in chosen} for e in edges
        )
        assert sorted(p for join in alignments for p in ends(join.edges)) == pairs  # each has its say once


def test_edges_of_an_alignment_have_their_target_in_the_first_cluster():
    poses, rng = world(6, 3)
    first, second = groups_of(poses, rng)
    one = edge(poses, 1, 4, rng)
    (join,) = align_clusters(first, second, [one.reversed()], MODEL)
    assert (join.edges[0].target, join.edges[0].source) == (1, 4)
    truth = poses[0].inverse() @ poses[3]
    found = join.first_from_second
    assert np.hypot(found.x - truth.x, found.y - truth.y) < 10.0 * DEVIATIONS[0] * max(1.0, truth.scale)


def test_hop_distances_and_connectivity():
    poses, rng = world(4, 0)
    members = {k: Similarity2() for k in range(4)}
    held = (edge(poses, 0, 1, rng), edge(poses, 1, 3, rng))
    assert not is_connected(Cluster(members, ()), held)
    ring = (*held, edge(poses, 2, 3, rng))
    assert is_connected(Cluster(members, ()), ring)
    np.testing.assert_array_equal(hop_distances(Cluster(members, ring), range(4))[0], [0, 1, 3, 2])
    np.testing.assert_array_equal(hop_distances(Cluster(members, ring), {3, 0}), [[0, 2], [2, 0]])
