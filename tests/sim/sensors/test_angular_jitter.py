"""Angular jitter: exact on flat walls, and no returns between two surfaces."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.robot.scan import LidarScan
from sim.sensors.angular_jitter import apply_angular_jitter


def scan_of(distance_at, beams: int = 360, angle_min: float = -math.pi, increment: float = math.tau / 360) -> LidarScan:
    ranges = distance_at(angle_min + increment * np.arange(beams))
    return LidarScan(0.0, angle_min, increment, 0.1, 50.0, np.asarray(ranges, np.float32))


def square(angles: np.ndarray) -> np.ndarray:
    """Inside a square room of 6 x 6 m."""
    return 3.0 / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))


@pytest.mark.parametrize("increment", [math.tau / 360, -math.tau / 360])
def test_on_flat_walls_jitter_equals_a_rotated_beam(increment: float) -> None:
    scan = scan_of(square, angle_min=-math.copysign(math.pi, increment), increment=increment)
    turns = np.random.default_rng(1).uniform(-0.03, 0.03, 360)
    read, elsewhere = apply_angular_jitter(scan, turns)
    to_corner = np.abs((scan.angles + turns + math.pi / 4) % (math.pi / 2))
    inside_a_wall = np.minimum(to_corner, math.pi / 2 - to_corner) > 2 * abs(increment)
    assert inside_a_wall.mean() > 0.9
    assert np.allclose(read[inside_a_wall], square(scan.angles + turns)[inside_a_wall], rtol=1e-6)
    assert not elsewhere.any()


def test_no_jitter_keeps_the_scan_bit_for_bit() -> None:
    ranges = np.random.default_rng(2).uniform(0.2, 40.0, 360)
    ranges[::7], ranges[::11] = np.inf, -np.inf
    scan = scan_of(lambda _: ranges)
    for turns in (np.zeros(360), np.where(np.arange(360) == 100, 0.01, 0.0)):
        read, elsewhere = apply_angular_jitter(scan, turns)
        kept = turns == 0.0
        assert np.array_equal(read.astype(np.float32)[kept], scan.ranges[kept])
        assert not elsewhere[kept].any()


def test_across_an_edge_a_beam_reads_one_side_or_the_other() -> None:
    scan = scan_of(lambda angles: np.where(np.abs(angles) < 0.5, 2.0, 6.0))
    turns = np.random.default_rng(3).uniform(-0.05, 0.05, 360)
    read, elsewhere = apply_angular_jitter(scan, turns)
    assert (np.isclose(read, 2.0, atol=0.01) | np.isclose(read, 6.0, atol=0.01)).all()
    assert np.array_equal(elsewhere, ~np.isclose(read, scan.ranges, atol=0.01))
    assert elsewhere.any()


@pytest.mark.parametrize("nothing", [np.inf, -np.inf])
def test_beside_a_beam_without_a_return_the_nearer_beam_is_read(nothing: float) -> None:
    scan = scan_of(lambda angles: np.where(np.arange(360) == 180, nothing, 2.0))
    for share, lost in ((0.4, [180]), (0.6, [179])):
        read, elsewhere = apply_angular_jitter(scan, np.full(360, share * scan.angle_increment))
        assert np.flatnonzero(~np.isfinite(read)).tolist() == lost
        assert np.flatnonzero(elsewhere).tolist() == ([] if lost == [180] else [179, 180])


def test_a_full_turn_is_circular_and_a_part_is_not() -> None:
    turned = math.radians(1.0)
    full = scan_of(lambda angles: 2.0 + 0.001 * np.arange(360))
    assert apply_angular_jitter(full, np.full(360, turned))[0][-1] == pytest.approx(2.0)
    part = scan_of(lambda angles: 2.0 + 0.001 * np.arange(180), 180, -math.pi / 2)
    assert apply_angular_jitter(part, np.full(180, turned))[0][-1] == pytest.approx(2.179)
    assert apply_angular_jitter(part, np.full(180, -turned))[0][0] == pytest.approx(2.0)


def test_a_single_beam_is_unchanged() -> None:
    assert apply_angular_jitter(scan_of(lambda _: np.array([3.0]), beams=1), np.array([0.2]))[0].tolist() == [3.0]
