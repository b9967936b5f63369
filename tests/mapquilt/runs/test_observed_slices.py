"""Observed cells of parts of a mission: unions of cached slices compared with tracing every scan."""

import numpy as np
import pytest

from mapping.ground_truth.footprint import observed
from mapquilt.runs.true_footprints import ObservedSlices, part_bounds
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from worlds.families.registry import make_world
from worlds.raster import true_raster


@pytest.fixture(scope="module")
def mission():
    return simulate(make_world("office", 5), MissionSettings(robots=2, duration=6.0), seed=5)[0]


@pytest.mark.parametrize("cuts", [(2,), (3, 2, 1), (1, 7)])
def test_the_observed_cells_of_a_part_are_those_of_its_scans(mission, cuts):
    frame = true_raster(mission.world).frame
    seen = ObservedSlices(mission, cuts)
    for parts in cuts:
        for robot, truth in enumerate(mission.robots):
            for part in range(parts):
                start, stop = part_bounds(len(truth.scans), part, parts)
                expected = observed(truth.part(start, stop), frame)
                assert np.array_equal(seen.seen(robot, start, stop, frame), expected)
                assert expected.any()
