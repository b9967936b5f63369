"""Laws of the tangent spaces of SE(2) and Sim(2): exp, log, adjoint, about, plus and minus."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array

metres = st.floats(-20, 20)
angles = st.floats(-3.1, 3.1)
log_scales = st.floats(-1.5, 1.5)
points = st.tuples(metres, metres)
velocities = st.tuples(metres, metres, angles)
scaling_velocities = st.tuples(metres, metres, angles, log_scales)
GROUPS = [(SE2, velocities), (Similarity2, scaling_velocities)]


def matrix(transform):
    """The (3, 3) matrix, read from where three points go."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    moved = transform.apply(corners)
    return np.vstack((np.column_stack((moved[1] - moved[0], moved[2] - moved[0], moved[0])), (0.0, 0.0, 1.0)))


def generator(tangent):
    """The (3, 3) element of the Lie algebra."""
    x, y, yaw, log_scale = (*tangent, 0.0)[:4]
    return np.array([[log_scale, -yaw, x], [yaw, log_scale, y], [0.0, 0.0, 0.0]])


def close(found, expected, tolerance=1e-8):
    np.testing.assert_allclose(matrix(found), matrix(expected), atol=tolerance, rtol=tolerance)


@pytest.mark.slow
@pytest.mark.parametrize(("group", "tangents"), GROUPS)
def test_exp_is_the_matrix_exponential(group, tangents):
    @given(tangents)
    def check(tangent):
        np.testing.assert_allclose(matrix(group.exp(tangent)), expm(generator(tangent)), atol=1e-9, rtol=1e-9)

    check()


@pytest.mark.parametrize(("group", "tangents"), GROUPS)
def test_log_inverts_exp(group, tangents):
    @given(tangents)
    def check(tangent):
        np.testing.assert_allclose(group.exp(tangent).log(), tangent, atol=1e-9)
        close(group.exp(group.exp(tangent).log()), group.exp(tangent))

    check()


@pytest.mark.parametrize(("group", "tangents"), GROUPS)
def test_the_adjoint_carries_a_perturbation_through_a_transform(group, tangents):
    @given(tangents, tangents)
    def check(placed, perturbation):
        transform = group.exp(placed)
        conjugate = transform @ group.exp(perturbation) @ transform.inverse()
        close(group.exp(transform.adjoint() @ perturbation), conjugate, 1e-7)
        np.testing.assert_allclose(transform.adjoint() @ perturbation, conjugate.log(), atol=1e-7, rtol=1e-7)

    check()


@pytest.mark.parametrize(("group", "tangents"), GROUPS)
def test_the_adjoint_is_a_homomorphism(group, tangents):
    @given(tangents, tangents)
    def check(one, other):
        a, b = group.exp(one), group.exp(other)
        np.testing.assert_allclose((a @ b).adjoint(), a.adjoint() @ b.adjoint(), atol=1e-9, rtol=1e-9)
        np.testing.assert_allclose(
            a.inverse().adjoint() @ a.adjoint(), np.eye(len(a.log())), atol=1e-8 * np.abs(a.adjoint()).max()
        )

    check()


@pytest.mark.parametrize(("group", "tangents"), GROUPS)
def test_the_inverse_undoes_a_transform(group, tangents):
    @given(tangents)
    def check(tangent):
        close(group.exp(tangent).inverse(), group.exp(-np.array(tangent)))

    check()


@pytest.mark.parametrize(("group", "tangents"), GROUPS)
def test_a_motion_about_a_point_is_that_motion_in_coordinates_of_the_point(group, tangents):
    @given(tangents, points)
    def check(tangent, centre):
        motion, there = group.exp(tangent), group(*centre)
        close(motion.about(centre), there @ motion @ there.inverse())
        np.testing.assert_allclose(motion.about(centre).log(), there.adjoint() @ motion.log(), atol=1e-8)
        close(motion.about((0.0, 0.0)), motion)
        close(motion.about(centre).about(-np.array(centre)), motion)

    check()


@pytest.mark.parametrize("group", [SE2, Similarity2])
def test_a_rotation_about_a_point_keeps_the_point(group):
    centre = np.array([3.0, -2.0])
    np.testing.assert_allclose(group(yaw=1.2).about(centre).apply(centre), centre)


@pytest.mark.parametrize("size", [0.0, 1e-300, 1e-12, 1e-8, 1e-6, 1e-4])
def test_exp_and_log_are_accurate_near_zero_angle_and_scale(size):
    for direction in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 1.0)):
        yaw, log_scale = size * np.array(direction)
        found = Similarity2.exp((2.0, -3.0, yaw, log_scale))
        rate = complex(log_scale, yaw)
        series = (2.0 - 3.0j) * (1.0 + rate / 2.0 + rate**2 / 6.0 + rate**3 / 24.0)
        assert complex(found.x, found.y) == pytest.approx(series, rel=1e-15, abs=1e-15)
        np.testing.assert_allclose(found.log(), (2.0, -3.0, yaw, log_scale), rtol=1e-14, atol=1e-15)
        np.testing.assert_allclose(SE2.exp((2.0, -3.0, yaw)).log(), (2.0, -3.0, yaw), rtol=1e-14, atol=1e-15)


@given(velocities)
def test_a_similarity_of_scale_one_is_a_rigid_motion(tangent):
    close(Similarity2.exp((*tangent, 0.0)), SE2.exp(tangent))
    np.testing.assert_allclose(Similarity2.exp((*tangent, 0.0)).adjoint()[:3, :3], SE2.exp(tangent).adjoint())


@given(scaling_velocities, scaling_velocities)
def test_plus_inverts_minus_and_perturbs_about_the_image_of_the_origin(placed, change):
    transform, step = Similarity2.exp(placed), 1e-5 * np.array(change)
    other = transform.plus(change)
    close(transform.plus(other.minus(transform)), other)
    np.testing.assert_allclose(other.minus(transform)[:2], change[:2], atol=1e-8)
    perturbed = Similarity2.exp(step).about((transform.x, transform.y)) @ transform
    close(transform.plus(step), perturbed, 1e-6)


@given(st.lists(st.tuples(scaling_velocities, points), min_size=1, max_size=5))
def test_a_batch_does_what_its_members_do(members):
    tangents, centres = np.array([tangent for tangent, _ in members]), np.array([centre for _, centre in members])
    singles = [Similarity2.exp(tangent) for tangent in tangents]
    batch = Similarity2Array.exp(tangents)
    expected = Similarity2Array.of(singles)
    np.testing.assert_allclose(batch.turn, expected.turn, atol=1e-12)
    np.testing.assert_allclose(batch.shift, expected.shift, atol=1e-10)
    np.testing.assert_allclose(batch.log(), [single.log() for single in singles], atol=1e-9)
    np.testing.assert_allclose(batch.adjoint(), [single.adjoint() for single in singles], atol=1e-10)
    about = Similarity2Array.of(single.about(centre) for single, centre in zip(singles, centres, strict=True))
    np.testing.assert_allclose(batch.about(centres).shift, about.shift, atol=1e-9)
    off = batch.minus(Similarity2Array.of(singles[:1]))
    for found, single in zip(off, singles, strict=True):
        wanted = single.minus(singles[0])
        assert math.remainder(found[2] - wanted[2], math.tau) == pytest.approx(0.0, abs=1e-9)
        np.testing.assert_allclose(found[[0, 1, 3]], wanted[[0, 1, 3]], atol=1e-9)
