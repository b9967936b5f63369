import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.records.prior import Expected, Extent, Prior, PriorSettings, expected_poses, shared_frame


def test_two_start_poses_give_the_transform_of_a_pair():
    places = expected_poses([Prior("a", 1.0, 2.0, math.pi / 2.0), Prior("b", 1.0, 5.0, math.pi, 0.5)], None)
    expected = places["a", "b"]
    assert expected.target_from_source.x == pytest.approx(3.0)
    assert expected.target_from_source.y == pytest.approx(0.0)
    assert expected.target_from_source.yaw == pytest.approx(math.pi / 2.0)
    assert expected.sigma == pytest.approx(math.hypot(1.0, 0.5))
    back = places["b", "a"].target_from_source
    assert back.x == pytest.approx(expected.target_from_source.inverse().x)


def test_an_answer_within_three_deviations_is_allowed():
    expected = expected_poses([Prior("b", 1.0, 5.0, 0.0, 0.5)], "a")["a", "b"]
    assert expected.allows(Similarity2(2.4, 5.0, 0.4))
    assert not expected.allows(Similarity2(2.6, 5.0, 0.0))
    assert not expected.allows(Similarity2(1.0, 5.0, 0.6))


scales = st.floats(0.5, 2.0)
numbers = st.floats(-20.0, 20.0)


@given(scales, scales, numbers, numbers, st.floats(-3.0, 3.0))
def test_the_true_pose_is_allowed_at_every_scale_and_in_every_direction(of_a, of_b, x, y, yaw):
    """``of_a`` and ``of_b``: metres of the reference per stated metre."""
    true = {"ref": Similarity2(), "a": Similarity2(1.0, -2.0, 0.7, of_a), "b": Similarity2(x, y, yaw, of_b)}
    priors = [Prior(name, pose.x, pose.y, pose.yaw, 0.01) for name, pose in true.items() if name != "ref"]
    expected = expected_poses(priors, "ref", scale=ScaleRange(0.25, 4.0))
    assert len(expected) == 6
    for (target, source), where in expected.items():
        assert where.allows(true[target].inverse() @ true[source])
        moved = true["ref" if "ref" in (target, source) else target].inverse()
        wrong = moved @ Similarity2(yaw=1.0) @ moved.inverse() @ (true[target].inverse() @ true[source])
        assert not where.allows(wrong)


def test_a_start_pose_on_the_reference_is_in_its_metres():
    where = expected_poses([Prior("b", 6.0, 0.0, 0.0, 0.1)], "a", scale=ScaleRange.free())
    assert where["a", "b"].allows(Similarity2(6.2, 0.0, 0.0, 0.5))
    assert not where["a", "b"].allows(Similarity2(9.0, 0.0, 0.0, 0.5))
    assert where["b", "a"].allows(Similarity2(6.2, 0.0, 0.0, 0.5).inverse())
    assert not where["b", "a"].allows(Similarity2(9.0, 0.0, 0.0, 0.5).inverse())


def test_an_answer_may_lie_as_far_outside_as_a_right_one_may_be_off():
    """Of a map of 30 m with its walls 10 m from its origin: 0.45 m and 2 degrees at 10 m, beside 3 sigma of 0.05 m."""
    where = Expected(Similarity2(1.0, 0.0), 0.05, extent=Extent(30.0, 10.0))
    most = 0.15 + 0.45 + 10.0 * math.radians(2.0)
    assert where.allows(Similarity2(1.0 + most - 0.01, 0.0))
    assert not where.allows(Similarity2(1.0 + most + 0.01, 0.0))


@given(
    st.sampled_from([ScaleRange(), ScaleRange.free(), ScaleRange(0.05, 20.0)]),
    st.floats(0.01, 50.0),
    st.floats(0.0, 80.0),
    st.booleans(),
)
def test_a_search_starts_at_every_scale_and_within_its_bounds(scale, sigma, arm, inverted):
    where = Expected(
        Similarity2(5.0, 1.0, 0.3), sigma, PriorSettings(), scale, extent=Extent(30.0, arm), inverted=inverted
    )
    starts = where.starts(600.0, Similarity2(scale=0.05), Similarity2(scale=0.05))
    assert 0 < len(starts) <= where.settings.max_starts
    assert all(where.allows(start) for start in _in_metres(starts))
    found = sorted({round(math.log(start.scale), 9) for start in starts})
    low, high = math.log(scale.low), math.log(scale.high)
    half = max((b - a for a, b in itertools.pairwise(found)), default=high - low) / 2.0
    assert found[0] - low == pytest.approx(half, abs=1e-6) and high - found[-1] == pytest.approx(half, abs=1e-6)


def test_a_small_prior_is_searched_as_finely_as_refinement_needs():
    """Every pose within 20 degrees and a factor of 2 puts the walls, 5 m from the origin, near those of some start."""
    where = Expected(Similarity2(), 0.05, PriorSettings(), ScaleRange.free(), extent=Extent(30.0, 5.0))
    cell = Similarity2(scale=0.05)
    starts = [cell @ start @ cell.inverse() for start in where.starts(600.0, cell, cell)]
    walls = np.array([[5.0, 0.0]])
    reached = np.array([start.apply(walls)[0] for start in starts])
    for yaw in np.radians([-20.0, -13.0, -2.0, 7.0, 20.0]):
        for scale in (0.5, 0.61, 0.97, 1.3, 2.0):
            aim = Similarity2(0.0, 0.0, float(yaw), scale).apply(walls)[0]
            assert np.hypot(*(reached - aim).T).min() < 0.08 * 30.0


def _in_metres(starts):
    cells = Similarity2(scale=0.05)
    return [cells @ start @ cells.inverse() for start in starts]


@pytest.mark.parametrize("yaw", [90.0, -45.0, 6.3])
def test_a_yaw_that_must_be_degrees_is_refused(yaw):
    with pytest.raises(ValueError, match=f"prior of a: yaw is {yaw:g} rad, .*; write {yaw:g}deg if it is in degrees"):
        Prior("a", 0.0, 0.0, yaw)


@pytest.mark.parametrize(
    ("priors", "reference", "says"),
    [
        ([Prior("a", 0, 0, 0)], "a", "that of a alone says nothing"),
        ([Prior("a", 0, 0, 0), Prior("a", 1, 0, 0)], None, "a has more than one"),
    ],
)
def test_useless_priors_are_refused(priors, reference, says):
    with pytest.raises(ValueError, match=says):
        expected_poses(priors, reference)


def test_a_single_prior_is_in_the_frame_of_the_first_other_map():
    one, two = Prior("a", 0, 0, 0), Prior("b", 1, 0, 0)
    assert shared_frame([one], None, ("a", "b", "c")) == "b"
    assert shared_frame([two], None, ("a", "b", "c")) == "a"
    assert shared_frame([one], "c", ("a", "b", "c")) == "c"
    assert shared_frame([one, two], None, ("a", "b", "c")) is None


@pytest.mark.parametrize("inverted", [False, True])
def test_the_distance_is_that_from_the_expected_pose(inverted):
    at = Similarity2(2.0, 1.0, 0.5)
    expected = replace(Expected(at, 1.0), inverted=inverted)
    found = Similarity2(5.0, 5.0, 0.2)
    assert expected.distance(found.inverse() if inverted else found) == pytest.approx((5.0, 0.3))


@pytest.mark.parametrize("sigma", [0.0, -1.0, math.inf])
def test_a_standard_deviation_must_be_positive(sigma):
    with pytest.raises(ValueError, match="prior of a: sigma"):
        Prior("a", 0.0, 0.0, 0.0, sigma)
