"""Many similarities at once, against one by one."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import wrap_angle
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array, rotations
from merge.multimap.edge import Edge, EdgeTable

metres = st.floats(-50.0, 50.0)
similarities = st.builds(Similarity2, metres, metres, st.floats(-3.1, 3.1), st.floats(0.3, 3.0))
several = st.lists(similarities, min_size=1, max_size=5)


def difference(predicted, measured):
    """The move (4,) of the source about its middle that takes it from where it was measured to where it should be."""
    return np.array(
        [
            predicted.x - measured.x,
            predicted.y - measured.y,
            wrap_angle(predicted.yaw - measured.yaw),
            math.log(predicted.scale / measured.scale),
        ]
    )


def close(motions, expected):
    found = np.stack((motions.turn.real, -motions.turn.imag, motions.shift.real), axis=-1)
    np.testing.assert_allclose(found, [place.matrix()[0] for place in expected], atol=1e-8)
    np.testing.assert_allclose(motions.shift.imag, [place.y for place in expected], atol=1e-8)


@given(several, similarities)
def test_products_and_inverses_are_those_of_similarities(places, other):
    close(Similarity2Array.of(places) @ Similarity2Array.of([other]), [place @ other for place in places])
    close(Similarity2Array.of([other]) @ Similarity2Array.of(places), [other @ place for place in places])
    close(Similarity2Array.of(places).inverse(), [place.inverse() for place in places])
    np.testing.assert_allclose(rotations(Similarity2Array.of(places).turn)[0], places[0].matrix()[:, :2], atol=1e-9)


@given(similarities, similarities)
def test_what_lies_between_is_the_difference(predicted, measured):
    found = Similarity2Array.of([predicted]).minus(Similarity2Array.of([measured]))[0]
    expected = difference(predicted, measured)
    found[2] = math.remainder(found[2] - expected[2], math.tau) + expected[2]  # half a turn is either way
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_a_misfit_is_a_square_by_both_covariances():
    rng = np.random.default_rng(0)
    root, slack_root = rng.standard_normal((2, 4, 4))
    covariance, slack = root @ root.T + np.eye(4), slack_root @ slack_root.T
    measured, told = Similarity2(3.0, -2.0, 0.5, 1.2), Similarity2(2.0, -1.5, 0.7, 1.1)
    table = EdgeTable.of([Edge(0, 1, measured, covariance, 1.0)])
    off = difference(told, measured)
    for fixed, unknowns in ((True, 3), (False, 4)):
        both = (covariance + slack)[:unknowns, :unknowns]
        expected = off[:unknowns] @ np.linalg.inv(both) @ off[:unknowns]
        assert table.misfits(Similarity2Array.of([told]), fixed, slack)[0] == pytest.approx(expected)
