"""Without noise and at true poses, a map equals the true raster within one cell."""

import numpy as np
import pytest
from scipy import ndimage

from mapping.grid.log_odds import LogOddsMapper
from mapping.grid.sensor_model import SENSOR_MODELS, sensor_model
from mapping.ground_truth.footprint import TRUE_RESOLUTION
from sim.mission.file import load_mission
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from worlds.families.registry import make_world
from worlds.raster import true_raster

NEIGHBOURS = np.ones((3, 3), bool)


@pytest.fixture(scope="module")
def lone_mission():
    return simulate(make_world("office", 5), MissionSettings(robots=1, duration=15.0), seed=5)[0]


def drawn(mission, index, model):
    """Map true scans of one robot at true poses, and look the map up on the world's raster: -1, 0 or 1 per cell."""
    truth, world = mission.robots[index], true_raster(mission.world, TRUE_RESOLUTION)
    mapper = LogOddsMapper(TRUE_RESOLUTION, sensor_model(model))
    for k, scan in enumerate(truth.scans):
        mapper.integrate(scan, truth.trajectory.pose(k) @ truth.base_from_lidar)
    grid = mapper.grid()
    cells = world.frame.cells_from_metres(grid.frame.metres_from_cells(np.argwhere(grid.known)))
    inside = world.frame.contains(cells)
    assert inside.mean() > 0.999
    signs = np.zeros(world.frame.shape, np.int8)
    signs[tuple(cells[inside].T)] = np.sign(grid.log_odds[grid.known])[inside]
    return signs, world.occupied


def disagree(signs, walls, excepted):
    """Observed cells that no cell within one of them explains."""
    wall_near = ndimage.binary_dilation(walls, NEIGHBOURS)
    free_near = ndimage.binary_dilation(~walls, NEIGHBOURS)
    return ((signs > 0) & ~wall_near & ~excepted) | ((signs < 0) & ~free_near & ~excepted)


@pytest.mark.parametrize("model", SENSOR_MODELS)
def test_the_map_of_one_robot_is_the_true_raster_within_a_cell(lone_mission, model):
    signs, walls = drawn(lone_mission, 0, model)
    assert (signs > 0).sum() > 500
    assert (signs < 0).sum() > 10_000
    assert not disagree(signs, walls, np.zeros_like(walls)).any()


def test_the_maps_of_a_team_are_the_true_raster_except_at_other_robots(merged_run):
    mission = load_mission(merged_run / "mission")
    for index in range(2):
        signs, walls = drawn(mission, index, "octomap")
        assert not disagree(signs, walls, under_robots(mission, walls.shape)).any()


def under_robots(mission, shape):
    """Cells within a robot's radius and two cells of where any robot ever was."""
    stood = np.ones(shape, bool)
    for robot in mission.robots:
        cols, rows = np.floor(robot.trajectory.poses[:, :2] / TRUE_RESOLUTION).astype(int).T
        stood[rows, cols] = False
    radius = max(robot.radius for robot in mission.settings.robots)
    return ndimage.distance_transform_edt(stood) * TRUE_RESOLUTION <= radius + 2 * TRUE_RESOLUTION


def test_a_map_rotated_by_mistake_would_be_detected(lone_mission):
    signs, walls = drawn(lone_mission, 0, "octomap")
    shifted = np.roll(signs, 3, axis=0)
    assert disagree(shifted, walls, np.zeros_like(walls)).any()
