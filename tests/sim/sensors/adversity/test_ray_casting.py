"""Beams on discs and segments: known answers, and a slow oracle."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.sensors.adversity.ray_casting import cast_on_discs, cast_on_segments

ORIGIN = np.zeros(2)
coordinate = st.floats(-10.0, 10.0)
point = st.tuples(coordinate, coordinate)


def beam(degrees: float) -> np.ndarray:
    return np.array([(math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))])


def test_a_beam_ends_on_the_near_side_of_a_disc() -> None:
    assert cast_on_discs(ORIGIN, beam(0.0), np.array([(3.0, 0.0)]), 0.2)[0] == pytest.approx(2.8)
    # 0.3 m beside the middle of a disc of 0.5 m: half a chord of 0.4 m before the nearest point at 4 m.
    assert cast_on_discs(ORIGIN, beam(0.0), np.array([(4.0, 0.3)]), 0.5)[0] == pytest.approx(3.6)


def test_a_beam_misses_discs_beside_and_behind_it_and_around_its_origin() -> None:
    for centre in ((3.0, 0.21), (-3.0, 0.0), (0.1, 0.1)):
        assert cast_on_discs(ORIGIN, beam(0.0), np.array([centre]), 0.2)[0] == math.inf
    assert cast_on_discs(ORIGIN, beam(0.0), np.empty((0, 2)), 0.2)[0] == math.inf


def test_the_nearest_disc_counts() -> None:
    centres = np.array([(5.0, 0.0), (3.0, 0.0), (4.0, 0.0)])
    assert cast_on_discs(ORIGIN, beam(0.0), centres, 0.5)[0] == pytest.approx(2.5)


@given(st.floats(0.0, 360.0), point, st.floats(0.05, 2.0))
def test_a_hit_lies_on_the_disc(degrees: float, centre: tuple[float, float], radius: float) -> None:
    distance = cast_on_discs(ORIGIN, beam(degrees), np.array([centre]), radius)[0]
    if math.isfinite(distance):
        assert np.hypot(*(distance * beam(degrees)[0] - centre)) == pytest.approx(radius, abs=1e-6)


@given(st.floats(0.0, 360.0), st.lists(st.tuples(point, point), max_size=4))
def test_segments_are_hit_where_linear_equations_say(degrees: float, sides: list) -> None:
    segments, direction = np.array(sides, dtype=float).reshape(-1, 2, 2), beam(degrees)
    nearest = math.inf
    for start, end in segments:
        matrix = np.column_stack((direction[0], start - end))
        if abs(np.linalg.det(matrix)) > 1e-6:
            distance, share = np.linalg.solve(matrix, start)
            if min(abs(share), abs(share - 1.0), abs(distance)) < 1e-6:
                return  # on the edge of a miss
            if distance > 0.0 and 0.0 < share < 1.0:
                nearest = min(nearest, distance)
        elif abs(np.linalg.det(matrix)) > 0.0:
            return
    assert cast_on_segments(ORIGIN, direction, segments)[0] == pytest.approx(nearest, rel=1e-6)
