"""Tests of the checks before compiled code that indexes by coordinates."""

import math

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame, require_area
from mapping.grid.log_odds import LogOddsMapper
from mapping.grid.traversal import HIT, draw_scan
from mapping.ground_truth.footprint import observed
from mapping.particle.tiles import TiledMaps
from mapping.robot.robot_log import RobotTruth
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory
from mapping.slam.correlation import likelihood_field
from mapping.slam.loops.visibility import free_space
from mapping.slam.settings import SlamSettings
from mapping.slam.tracking.surfels import surfel_map
from sim.mission.first_seen import first_seen

FAR = np.array([[0.0, 0.0], [1e9, 1e9]])


def draw(start, end, shape=(4, 6), visits=(4, 6)):
    arrays = np.zeros(shape, np.float32), np.zeros(visits, np.int32), np.zeros(shape, np.int32)
    ends, kinds = np.array([end], np.float64), np.array([HIT], np.int8)
    draw_scan(*arrays, np.int32(1), *start, ends, kinds, *(np.float32(1.0),) * 4, True)
    return arrays[0]


@pytest.mark.parametrize(
    ("start", "end"),
    [
        ((0.5, 0.5), (6.0, 0.5)),
        ((0.5, 0.5), (0.5, 4.0)),
        ((0.5, 0.5), (-1e-9, 0.5)),
        ((-0.1, 0.5), (0.5, 0.5)),
        ((0.5, 9.0), (0.5, 0.5)),
        ((0.5, 0.5), (math.nan, 0.5)),
        ((0.5, 0.5), (0.5, 1e300)),
    ],
)
def test_a_beam_that_leaves_the_raster_is_refused(start, end):
    with pytest.raises(ValueError, match=r"^scan 1: a beam leaves the raster of 4 x 6 cells$"):
        draw(start, end)


def test_arrays_of_unlike_shapes_are_refused():
    with pytest.raises(ValueError, match="a beam leaves the raster"):
        draw((0.5, 0.5), (5.5, 3.5), visits=(1, 1))


def test_a_beam_to_the_last_cell_is_drawn():
    assert draw((0.0, 0.0), (5.999, 3.999))[3, 5] == 1.0


def test_a_lidar_a_hair_below_a_border_of_cells_is_mapped():
    """-1e-17 m lies in cell -1, but 40 cells further it is rounded to the border."""
    scan = LidarScan(0.0, math.pi, 1.0, 0.1, 9.0, np.array([2.0], np.float32))
    pose = SE2(-1e-17, 0.02)
    mapper = LogOddsMapper(0.05)
    mapper.integrate(scan, pose)
    assert mapper.grid().occupied.sum() == 1
    maps = TiledMaps(1, 0.05)
    maps.integrate(0, scan, pose, 0.0)
    seen = RobotTruth([scan], Trajectory([0.0], [[*(-1e-17, 0.02), 0.0]]), np.zeros((1, 1), bool), SE2())
    assert observed(seen, GridFrame(0.05, SE2(-5.0, -5.0), (200, 200))).any()


def truth(reach, mounting):
    scans = [LidarScan(0.0, 0.0, 1.0, 0.1, 1e9, np.array([reach], np.float32))]
    return RobotTruth(scans, Trajectory([0.0], [[1.0, 1.0, 0.0]]), np.zeros((1, 1), bool), mounting)


@pytest.mark.parametrize(("reach", "mounting"), [(5.0, SE2()), (0.5, SE2(5.0)), (0.5, SE2(0.0, -9.0))])
def test_a_beam_that_leaves_the_world_is_refused(reach, mounting):
    with pytest.raises(ValueError, match=r"^scan 1: a beam leaves the raster"):
        first_seen(truth(reach, mounting), GridFrame(0.05, SE2(), (40, 40)))


def test_a_footprint_of_beams_that_end_far_apart_is_refused():
    with pytest.raises(ValueError, match=r"^observed: spans 1e\+09 x 0 m, must have at most"):
        observed(truth(1e9, SE2()), GridFrame(0.05, SE2(), (40, 40)))


@pytest.mark.parametrize("far", [1e9, 1e300, math.inf, math.nan])
def test_points_too_far_apart_for_a_grid_are_refused(far):
    points = np.array([[0.0, 0.0], [far, far]])
    with pytest.raises(ValueError, match=r"^walls: spans"):
        require_area("walls", points[0], points[1], 0.1)


def test_grids_of_slam_refuse_points_too_far_apart():
    with pytest.raises(ValueError, match=r"^surfel_map: spans"):
        surfel_map(FAR, np.ones((2, 2)), 0.3, SlamSettings().local_map)
    with pytest.raises(ValueError, match=r"^free_space: spans"):
        free_space(FAR * 0.0, FAR, 0.1)
    with pytest.raises(ValueError, match=r"^likelihood_field: spans"):
        likelihood_field(FAR, 0.1, 0.2, 1.0)
