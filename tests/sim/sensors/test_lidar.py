"""Limits of the lidar, and refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sim.sensors.lidar import Lidar


def test_ranges_beyond_the_limits_become_infinite() -> None:
    lidar = Lidar(beams=5, angle_increment=0.1, range_min=0.2, range_max=4.0)
    scan = lidar.scan(1.5, np.array([0.1, 0.2, 4.0, 4.001, np.inf]))
    assert scan.ranges.tolist() == [-np.inf, np.float32(0.2), 4.0, np.inf, np.inf]
    assert (scan.stamp, scan.range_min, scan.range_max) == (1.5, 0.2, 4.0)


def test_a_full_turn_has_no_beam_twice() -> None:
    angles = Lidar().angles
    assert angles[0] == -math.pi
    assert angles[-1] == pytest.approx(math.pi - math.tau / 360)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("beams", 0),
        ("angle_increment", 0.0),
        ("angle_increment", math.tau / 100),
        ("angle_min", math.nan),
        ("range_min", -0.1),
        ("range_max", 0.15),
        ("range_max", math.inf),
        ("rate", 0.0),
        ("rate", -10.0),
    ],
)
def test_bad_fields_are_refused_by_name_and_value(field: str, value: float) -> None:
    with pytest.raises(ValueError, match=rf"{field} is {value}"):
        Lidar(**{field: value})
