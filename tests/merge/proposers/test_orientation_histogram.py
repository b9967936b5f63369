import math

import numpy as np
import pytest

from mapping.geometry.similarity2 import Similarity2
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.orientation_histogram import correlate_histograms, likely_yaws, orientation_histogram
from tests.merge.rooms import cave, observed, rooms, viewpoints


def prepared_maps(build, seed, yaw):
    """Two maps of one world, the second turned by -yaw: target from source turns by yaw."""
    rng = np.random.default_rng(seed)
    world = build(rng)
    grids = [
        observed(world, viewpoints(world, rng, *part, number=20), Similarity2(yaw=turn), rng)
        for part, turn in ((((0.3, 0.3), (12.0, 10.7)), 0.4), (((4.0, 0.3), (15.7, 10.7)), 0.4 - yaw))
    ]
    return [PreparedMap(grid) for grid in grids]


def off_deg(yaws, yaw):
    return min(abs(math.degrees(math.remainder(found - yaw, math.tau))) for found in yaws)


@pytest.mark.parametrize("yaw", [0.0, 0.3, -2.0, 3.0])
def test_the_rotation_of_rectilinear_maps_is_among_few(yaw):
    target, source = prepared_maps(rooms, 3, yaw)
    yaws = likely_yaws(orientation_histogram(target.normals), orientation_histogram(source.normals))
    assert len(yaws) <= 8
    assert off_deg(yaws, yaw) < 2.0


@pytest.mark.parametrize("seed", range(3))
def test_the_rotation_of_caves_is_among_few(seed):
    target, source = prepared_maps(cave, seed, 1.3)
    yaws = likely_yaws(orientation_histogram(target.normals), orientation_histogram(source.normals))
    assert len(yaws) <= 8
    assert off_deg(yaws, 1.3) < 7.0


def test_rotating_the_source_shifts_the_correlation():
    angles = np.radians(np.concatenate((np.full(60, 20.3), np.full(30, 71.3), np.full(10, 140.3))))
    target = orientation_histogram(np.stack((np.cos(angles), np.sin(angles)), axis=-1))
    source = orientation_histogram(np.stack((np.cos(angles - 0.9), np.sin(angles - 0.9)), axis=-1))
    assert correlate_histograms(target, source).argmax() == round(math.degrees(0.9))
    assert correlate_histograms(source, target).argmax() == 180 - round(math.degrees(0.9))
    assert correlate_histograms(target, target).max() == pytest.approx(1.0)


def test_without_walls_no_rotation_is_likely():
    blank = orientation_histogram(np.zeros((5, 2)))
    assert not blank.any()
    assert likely_yaws(blank, blank) == []
