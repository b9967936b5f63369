import math

import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.literature.hough import (
    Hough,
    circular_correlation,
    highest_maxima,
    hough_spectrum,
    projection_shift,
)
from tests.merge.literature.crisp import YAW, blank, crisp_pair, off_share

CORNER = np.array([(x, 0.0) for x in range(40)] + [(0.0, y) for y in range(1, 25)])


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_crisp_pair_of_one_scale_is_found_and_accepted(seed):
    target, source, truth = crisp_pair(1.0, seed)
    method = Hough()
    maps = method.describe(target), method.describe(source)
    answer = method.published(*maps, ScaleRange.known(), np.random.default_rng(0))
    assert answer.verdict.accepted
    assert off_share(answer.target_from_source, truth, source) < 0.01
    proposals = method.propose(*maps, ScaleRange.known(), np.random.default_rng(0))
    assert len(proposals) == 12
    assert proposals[0].target_from_source == answer.target_from_source


def test_the_stated_scale_is_kept():
    target, source, truth = crisp_pair(1.3, 3)
    method = Hough(acceptance_index=0.5)
    maps = method.describe(target), method.describe(source)
    answer = method.published(*maps, ScaleRange(0.65, 2.6), np.random.default_rng(0))
    assert answer.target_from_source.scale == pytest.approx(1.3)
    assert off_share(answer.target_from_source, truth, source) < 0.02


def test_the_spectrum_equals_a_slow_vote():
    points = np.random.default_rng(0).uniform(0, 12, (9, 2))
    slow = np.zeros(360)
    for degrees in range(360):
        votes: dict[int, int] = {}
        for x, y in points - points.mean(axis=0):
            theta = math.radians(degrees % 180)
            rho = round(x * math.cos(theta) + y * math.sin(theta))
            votes[rho] = votes.get(rho, 0) + 1
        slow[degrees] = sum(count**2 for count in votes.values())
    assert np.array_equal(hough_spectrum(points), slow)


def test_the_spectrum_rotates_with_walls_and_is_invariant_to_shifts():
    spectrum = hough_spectrum(CORNER)
    assert int(spectrum.argmax()) == 90  # the longer wall runs along x
    turned = hough_spectrum(Similarity2(300.0, -80.0, math.radians(37)).apply(CORNER))
    assert int(turned.argmax()) == 127
    assert int(circular_correlation(turned, spectrum)[:180].argmax()) == 37


def test_circular_correlation_equals_its_sum():
    a, b = np.random.default_rng(1).random((2, 360))
    slow = [sum(a[(i + k) % 360] * b[i] for i in range(360)) for k in range(360)]
    assert np.allclose(circular_correlation(a, b), slow)


def test_local_maxima_are_circular():
    values = np.zeros(360)
    values[[0, 359, 90, 200, 201]] = (5.0, 1.0, 7.0, 6.0, 6.0)
    assert highest_maxima(values, 4) == [90, 200, 0]
    assert highest_maxima(values, 2) == [90, 200]


def test_projections_give_the_shift():
    rng = np.random.default_rng(2)
    walls = np.repeat(rng.integers(0, 90, 12), 20) + 0.5
    assert projection_shift(walls + 17.0, walls) == 17.0
    assert projection_shift(walls, walls + 230.0) == -230.0


def test_the_rotation_of_a_crisp_pair_follows_from_its_walls():
    target, source, _ = crisp_pair(1.0, 3)
    method = Hough()
    correlation = circular_correlation(method.describe(target).spectrum, method.describe(source).spectrum)
    peaks = highest_maxima(correlation, 4)
    assert min(abs(peak - math.degrees(YAW)) for peak in peaks) < 1.0


def test_nothing_is_found_without_walls():
    target, _, _ = crisp_pair()
    method = Hough()
    maps = method.describe(target), method.describe(blank())
    assert method.propose(*maps, ScaleRange.known(), np.random.default_rng(0)) == ()
    assert method.published(*maps, ScaleRange.known(), np.random.default_rng(0)).target_from_source is None


@pytest.mark.parametrize(("field", "value"), [("rotations", 0), ("acceptance_index", 1.5)])
def test_a_bad_setting_is_named(field, value):
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        Hough(**{field: value})
