import math

import pytest

from mapping.geometry.similarity2 import Similarity2
from merge.records.prior import Prior, expected_poses


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


@pytest.mark.parametrize(
    ("priors", "says"),
    [
        ([Prior("a", 0, 0, 0)], "that of a alone says nothing"),
        ([Prior("a", 0, 0, 0), Prior("a", 1, 0, 0)], "a has more than one"),
    ],
)
def test_useless_priors_are_refused(priors, says):
    with pytest.raises(ValueError, match=says):
        expected_poses(priors, None)


@pytest.mark.parametrize("sigma", [0.0, -1.0, math.inf])
def test_a_standard_deviation_must_be_positive(sigma):
    with pytest.raises(ValueError, match="prior of a: sigma"):
        Prior("a", 0.0, 0.0, 0.0, sigma)
