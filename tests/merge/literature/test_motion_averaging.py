"""Robust motion averaging on graphs whose poses are known."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.similarity2 import Similarity2
from merge.literature.motion_averaging import MotionAveraging, RelativeMotion

CORNERS = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 12.0], [0.0, 12.0]])


def team(number, rng):
    """Draw poses of maps, the first in the reference."""
    drawn = rng.uniform((-30.0, -30.0, -3.0, 0.7), (30.0, 30.0, 3.0, 1.4), (number, 4)).tolist()
    return [Similarity2(), *(Similarity2(*row) for row in drawn[1:])]


def motion(poses, target, source, noise=None):
    exact = poses[target].inverse() @ poses[source]
    return RelativeMotion(target, source, exact if noise is None else exact @ Similarity2.exp(noise))


def average(motions, number, seed=0, **changes):
    return MotionAveraging(**changes).average(motions, [CORNERS] * number, np.random.default_rng(seed))


def largest_gap(found, truth):
    gaps = [one.apply(CORNERS) - true.apply(CORNERS) for one, true in zip(found, truth, strict=True)]
    return float(np.abs(gaps).max())


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_exact_motions_give_exact_poses_and_wrong_ones_are_removed(seed):
    rng = np.random.default_rng(seed)
    poses = team(6, rng)
    motions = [motion(poses, a, b) for a, b in combinations(range(6), 2)]
    for k in (2, 7, 11):
        motions[k] = RelativeMotion(motions[k].target, motions[k].source, team(2, rng)[1])
    found = average(motions, 6)
    wrong = {k for k in range(15) if not found.kept[k]}
    assert wrong <= {2, 7, 11}
    if wrong == {2, 7, 11}:  # a wrong motion may be right by chance
        assert largest_gap(found.reference_from_map, poses) < 1e-6


def test_the_average_is_nearer_than_any_chain():
    rng = np.random.default_rng(4)
    averaged, chained = [], []
    for _ in range(20):
        poses = team(7, rng)
        noises = iter(rng.normal(0.0, (0.1, 0.1, 0.005, 0.005), (21, 4)))
        motions = [motion(poses, a, b, next(noises)) for a, b in combinations(range(7), 2)]
        averaged.append(largest_gap(average(motions, 7).reference_from_map, poses))
        star = average(motions[:6], 7)  # the motions of the first map alone: nothing to average
        assert star.kept.all()
        chained.append(largest_gap(star.reference_from_map, poses))
    assert np.median(averaged) < 0.8 * np.median(chained)


def test_the_loops_of_the_average_balance_at_every_map():
    """The tangents of the loops at each map add up to nothing, where the squares are least."""
    rng = np.random.default_rng(5)
    poses = team(5, rng)
    motions = [motion(poses, a, b, rng.normal(0.0, 0.01, 4)) for a, b in combinations(range(5), 2)]
    found = average(motions, 5).reference_from_map
    pull = np.zeros((5, 4))
    for one in motions:
        loop = (found[one.target] @ one.target_from_source @ found[one.source].inverse()).log()
        pull[one.target] += loop
        pull[one.source] -= loop
    assert np.abs(pull).max() < 1e-8
    assert found[0] == Similarity2()


def test_maps_that_nothing_joins_have_no_pose():
    poses = team(6, np.random.default_rng(1))
    motions = [motion(poses, 4, 5), motion(poses, 1, 2), motion(poses, 3, 2)]
    found = average(motions, 6)
    assert [pose is not None for pose in found.reference_from_map] == [False, True, True, True, False, False]
    assert found.reference_from_map[1] == Similarity2()
    assert found.kept.tolist() == [False, True, True]
    nothing = average([], 2)
    assert nothing.kept.tolist() == []


def test_the_same_seed_gives_the_same_poses():
    rng = np.random.default_rng(2)
    poses = team(6, rng)
    motions = [motion(poses, a, b, rng.normal(0.0, 0.02, 4)) for a, b in combinations(range(6), 2)]
    assert average(motions, 6, seed=3).reference_from_map == average(motions, 6, seed=3).reference_from_map


@pytest.mark.parametrize(("field", "value"), [("samples", 0), ("most_displacement", 1.5)])
def test_a_bad_setting_is_named(field, value):
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        MotionAveraging(**{field: value})
