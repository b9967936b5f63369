import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.preparation.prepared_map import PreparedMap
from merge.records.pair_answer import Uncertainty
from merge.verification.uncertainty import uncertainty
from tests.merge.rooms import corridor, observed, rooms, viewpoints

numbers = st.floats(-50.0, 50.0)
similarities = st.builds(Similarity2, numbers, numbers, st.floats(-3.1, 3.1), st.floats(0.3, 3.0))
moves = st.tuples(*[st.floats(-1e-4, 1e-4)] * 4).map(np.array)


def moved(answer, centre, move):
    """``answer`` after a small move about the centre, which both are in cells of the target."""
    x, y, turn, growth = move
    by = Similarity2(yaw=turn, scale=math.exp(growth))
    shift = centre + np.array([x, y]) - by.apply(centre)
    return Similarity2(*shift.tolist(), turn, math.exp(growth)) @ answer


def parameters(transform):
    return np.array([transform.x, transform.y, transform.yaw, transform.scale])


def difference(there, here):
    off = parameters(there) - parameters(here)
    off[2] = math.remainder(off[2], math.tau)
    return off


@given(similarities, similarities, similarities, numbers, moves)
def test_a_motion_of_the_cells_is_a_motion_of_the_parameters(answer, target, source, middle, move):
    centre = answer.apply(np.array([middle, 10.0]))
    metric = target @ answer @ source.inverse()
    expected = difference(target @ moved(answer, centre, move) @ source.inverse(), metric)
    covariance = Uncertainty(centre, np.outer(move, move)).of_parameters(target, metric)
    np.testing.assert_allclose(covariance, np.outer(expected, expected), atol=1e-3 * np.abs(covariance).max() + 1e-12)


@given(similarities, numbers, moves)
def test_the_inverse_answer_is_moved_by_the_inverse(answer, middle, move):
    centre = answer.apply(np.array([middle, 10.0]))
    back = Uncertainty(centre, np.outer(move, move)).inverse(answer)
    expected = difference(moved(answer, centre, move).inverse(), answer.inverse())
    covariance = back.of_parameters(Similarity2.identity(), answer.inverse())
    np.testing.assert_allclose(covariance, np.outer(expected, expected), atol=1e-3 * np.abs(covariance).max() + 1e-12)


@given(similarities, numbers)
def test_the_inverse_of_the_inverse_is_itself(answer, middle):
    one = Uncertainty(np.array([middle, 3.0]), np.diag([1.0, 2.0, 3.0, 4.0]))
    again = one.inverse(answer).inverse(answer.inverse())
    np.testing.assert_allclose(again.centre, one.centre, atol=1e-9)
    np.testing.assert_allclose(again.covariance, one.covariance, atol=1e-9)


def prepared_maps(world, seed, parts):
    rng = np.random.default_rng(seed)
    return [
        PreparedMap(observed(world, viewpoints(world, rng, *part, number=25), Similarity2.identity(), rng, noise=0.01))
        for part in parts
    ]


def aligned(target, source):
    """The true cells to cells of maps that were drawn in the world's frame."""
    cells = [
        Similarity2.from_se2(prepared.grid.frame.origin, prepared.grid.frame.resolution)
        for prepared in (target, source)
    ]
    return cells[0].inverse() @ cells[1]


@pytest.fixture(scope="module")
def crisp():
    world = rooms(np.random.default_rng(5))
    target, source = prepared_maps(world, 5, (((0.3, 0.3), (11.0, 10.7)), ((4.5, 0.3), (15.7, 10.7))))
    return target, source, aligned(target, source)


def test_crisp_rooms_are_known_within_a_cell(crisp):
    target, source, answer = crisp
    deviations = np.sqrt(np.diag(uncertainty(target, source, answer, ScaleRange.free()).covariance))
    assert 0.001 < deviations[:2].max() < 1.0
    assert math.degrees(deviations[2]) < 0.2
    assert deviations[3] < 0.003


def test_a_known_scale_is_exact_and_helps_the_rest(crisp):
    target, source, answer = crisp
    free = uncertainty(target, source, answer, ScaleRange.free()).covariance
    known = uncertainty(target, source, answer, ScaleRange.known()).covariance
    assert not known[3].any() and not known[:, 3].any()
    assert np.all(np.diag(known)[:3] <= np.diag(free)[:3] * (1.0 + 1e-9))


def test_swapping_the_maps_gives_the_covariance_of_the_inverse(crisp):
    target, source, answer = crisp
    there = uncertainty(target, source, answer, ScaleRange.free()).inverse(answer)
    back = uncertainty(source, target, answer.inverse(), ScaleRange.free())
    for one, other in zip(np.diag(there.covariance), np.diag(back.covariance), strict=True):
        assert 0.5 < one / other < 2.0  # the patches are cut elsewhere


def test_a_bare_corridor_is_uncertain_along_and_certain_across():
    target, source = prepared_maps(corridor(), 1, (((8.0, 0.5), (20.0, 2.2)), ((14.0, 0.5), (30.0, 2.2))))
    answer = aligned(target, source)
    lengths, axes = np.linalg.eigh(uncertainty(target, source, answer, ScaleRange.known()).covariance[:2, :2])
    assert abs(axes[0, 1]) > 0.99  # along x
    assert math.sqrt(lengths[1]) > 50.0 * math.sqrt(lengths[0])


def test_without_matching_walls_only_the_size_of_the_maps_bounds_the_answer(crisp):
    target, source, _ = crisp
    deviations = np.sqrt(np.diag(uncertainty(target, source, Similarity2(1e5), ScaleRange.free()).covariance))
    np.testing.assert_allclose(deviations[:2], min(target.diagonal, source.diagonal))


def test_precision_probability_is_the_share_of_draws_within_tolerance():
    sigma = math.radians(1.5), 0.02
    estimated = Uncertainty(np.zeros(2), np.diag([9.0, 9.0, sigma[0] ** 2, sigma[1] ** 2])).precision_probability
    turn, growth = np.random.default_rng(0).laplace(size=(2, 200_000)) * np.array(sigma)[:, None] / math.sqrt(2.0)
    right = (np.abs(np.degrees(turn)) < 2.0) & (np.abs(growth) < math.log(1.03))
    assert estimated == pytest.approx(right.mean(), abs=0.005)


def test_a_known_scale_does_not_lower_the_precision_probability():
    known = Uncertainty(np.zeros(2), np.diag([1.0, 1.0, 1e-8, 0.0]))
    assert known.precision_probability == pytest.approx(1.0)
