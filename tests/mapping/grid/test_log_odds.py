"""The compiled mapper against a slow one in exact arithmetic, and answers worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.grid.log_odds import COUNTING_LIMIT, LogOddsMapper, map_log
from mapping.grid.sensor_model import SENSOR_MODELS, CountingModel, LogOddsModel, sensor_model
from mapping.grid.traversal import MISS, draw_scan
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory
from tests.oracles.slow_mapper import slow_map, slow_traverse

SIDE = 60


def scan_of(ranges, stamp=0.0, range_max=8.0):
    ranges = np.asarray(ranges, np.float32)
    return LidarScan(stamp, -math.pi, 2 * math.pi / len(ranges), 0.1, range_max, ranges)


def random_scan(rng, beams=40):
    ranges = rng.uniform(0.1, 8.0, beams).astype(np.float32)
    ranges[rng.random(beams) < 0.15] = np.inf
    ranges[rng.random(beams) < 0.05] = -np.inf
    return scan_of(ranges)


def crossed(x0, y0, x1, y1):
    """The cells (row, col) that one beam without a hit at its end touches."""
    last_scan = np.zeros((SIDE, SIDE), np.int32)
    total, visits, scan = np.zeros_like(last_scan, np.float32), np.zeros((1, 1), np.int32), np.int32(1)
    hit, miss, low, high = np.float32([1.0, -1.0, -9.0, 9.0])
    ends, says = np.array([[x1, y1]]), np.array([MISS], np.int8)
    draw_scan(total, visits, last_scan, scan, x0, y0, ends, says, hit, miss, low, high, False)
    assert (total == -last_scan).all()
    return {tuple(cell) for cell in np.argwhere(last_scan).tolist()}


@given(*[st.integers(0, 1024 * SIDE - 1).map(lambda n: n / 1024)] * 4)
def test_traversal_equals_the_slow_reference(x0, y0, x1, y1):
    assert crossed(x0, y0, x1, y1) == set(slow_traverse(x0, y0, x1, y1))


@given(*[st.integers(0, 24)] * 4)
def test_traversal_through_corners_and_along_borders(x0, y0, x1, y1):
    assert crossed(x0 / 2, y0 / 2, x1 / 2, y1 / 2) == set(slow_traverse(x0 / 2, y0 / 2, x1 / 2, y1 / 2))


def test_gmapping_names_the_model_that_counts():
    assert sensor_model("gmapping") is sensor_model("counting")


@pytest.mark.parametrize("name", SENSOR_MODELS)
@pytest.mark.parametrize("clear_range", [0.0, 3.0, 100.0])
def test_mapper_equals_the_slow_reference_in_every_cell(name, clear_range):
    rng = np.random.default_rng(5)
    scans = [(random_scan(rng), SE2(*rng.uniform(-3, 3, 2), rng.uniform(-9, 9))) for _ in range(12)]
    mapper = LogOddsMapper(0.25, sensor_model(name), clear_range)
    for scan, pose in scans:
        mapper.integrate(scan, pose)
    grid = mapper.grid()
    slow = slow_map(scans, 0.25, sensor_model(name), clear_range)
    first = np.rint([grid.frame.origin.y / 0.25, grid.frame.origin.x / 0.25]).astype(int)
    known = {
        tuple(int(n) for n in cell + first): value
        for cell, value in zip(np.argwhere(grid.known), grid.log_odds[grid.known], strict=True)
    }
    assert known.keys() == slow.keys()
    for cell, value in slow.items():
        if isinstance(sensor_model(name), LogOddsModel):
            assert known[cell] == pytest.approx(value, abs=1e-4)
        else:
            assert (known[cell] > 0) == (value > 1e-12)


def test_a_hit_wins_over_misses_of_the_same_scan():
    scan = LidarScan(0.0, -0.01, 0.01, 0.1, 8.0, np.array([1.99, 1.01, 1.99], np.float32))
    mapper = LogOddsMapper(1.0)
    mapper.integrate(scan, SE2(0.5, 0.5, 0.0))
    grid = mapper.grid()
    assert grid.occupancy().tolist() == [[0, 100, 100]]


def test_each_cell_counts_once_per_scan():
    scan = LidarScan(0.0, 0.0, 1e-6, 0.1, 8.0, np.full(50, 3.0, np.float32))
    mapper = LogOddsMapper(1.0, LogOddsModel("once", 0.7, 0.4, -50.0, 50.0))
    mapper.integrate(scan, SE2(0.5, 0.5, 0.0))
    expected = [math.log(2 / 3)] * 3 + [math.log(7 / 3)]
    assert mapper.grid().log_odds[0] == pytest.approx(expected)


def test_a_cell_whose_evidence_cancels_stays_known_and_free():
    model = LogOddsModel("even", 0.6, 0.4, -5.0, 5.0)
    mapper = LogOddsMapper(1.0, model)
    for reading in (1.0, 2.0):
        mapper.integrate(LidarScan(0.0, 0.0, 0.1, 0.1, 8.0, np.array([reading], np.float32)), SE2(0.5, 0.5, 0.0))
    assert mapper.grid().occupancy().tolist() == [[0, 0, 100]]


def test_no_return_is_not_a_wall_at_the_end_of_the_range():
    for clear_range, expected in [(8.0, 9), (2.0, 3)]:
        mapper = LogOddsMapper(1.0, clear_range=clear_range)
        mapper.integrate(LidarScan(0.0, 0.0, 0.1, 0.1, 8.0, np.array([np.inf], np.float32)), SE2(0.5, 0.5, 0.0))
        assert mapper.grid().occupancy().tolist() == [[0] * expected]


def test_no_return_clears_nothing_unless_asked():
    mapper = LogOddsMapper(1.0)
    mapper.integrate(scan_of([np.inf, -np.inf]), SE2())
    with pytest.raises(ValueError, match="no map"):
        mapper.grid()


def test_growth_keeps_observed_cells():
    rng = np.random.default_rng(2)
    poses = [SE2(x, y, 0.3) for x, y in [(0, 0), (-40, 3), (25, -60), (80, 80)]]
    scans = [random_scan(rng) for _ in poses]
    together = LogOddsMapper(0.5)
    for scan, pose in zip(scans, poses, strict=True):
        together.integrate(scan, pose)
    alone = LogOddsMapper(0.5)
    alone.integrate(scans[0], poses[0])
    grid, first = together.grid(), alone.grid()
    points = first.frame.metres_from_cells(np.argwhere(first.known))
    cells = grid.frame.cells_from_metres(points)
    assert np.array_equal(grid.log_odds[cells[:, 0], cells[:, 1]], first.log_odds[first.known])


def test_a_map_with_too_many_cells_is_refused():
    mapper = LogOddsMapper(0.05)
    mapper.integrate(scan_of([1.0]), SE2())
    with pytest.raises(ValueError, match="must have at most"):
        mapper.integrate(scan_of([1.0]), SE2(1e7, 1e7, 0.0))


def test_counting_has_log_odds_about_its_threshold():
    mapper = LogOddsMapper(1.0, CountingModel("count", threshold=0.25))
    for reading in (2.0, 2.0, 3.0):
        mapper.integrate(LidarScan(0.0, 0.0, 0.1, 0.1, 8.0, np.array([reading], np.float32)), SE2(0.5, 0.5, 0.0))
    log_odds = mapper.grid().log_odds[0]
    assert log_odds[2] == pytest.approx(math.log(2.0) - math.log(1 / 3), abs=1e-6)
    assert log_odds[0] == -COUNTING_LIMIT
    assert log_odds[3] == COUNTING_LIMIT


def after(name, hits, misses):
    """The log-odds of a cell that so many scans hit, and then so many see through."""
    mapper = LogOddsMapper(1.0, sensor_model(name))
    for reading in [2.0] * hits + [3.0] * misses:
        mapper.integrate(LidarScan(0.0, 0.0, 0.1, 0.1, 8.0, np.array([reading], np.float32)), SE2(0.5, 0.5, 0.0))
    grid = mapper.grid()
    return grid.log_odds[0, 2 - round(grid.frame.origin.x)]


@pytest.mark.parametrize(
    ("name", "hit", "miss", "least", "most"),
    [
        ("octomap", 0.7, 0.4, 0.1192, 0.971),  # prob_hit, prob_miss and the two clamping thresholds of the library
        ("cartographer", 0.55, 0.49, 0.1, 0.9),  # hit_probability, miss_probability; kMinProbability, kMaxProbability
        ("hector", 0.9, 0.4, 0.0, 1.0),  # map_update_factor_occupied and _free; 50 in log-odds is as good as certain
    ],
)
def test_hit_and_miss_have_the_log_odds_of_their_source(name, hit, miss, least, most):
    def probability(hits, misses):
        return 1.0 / (1.0 + math.exp(-after(name, hits, misses)))

    assert probability(1, 0) == pytest.approx(hit, abs=1e-6)
    assert probability(0, 1) == pytest.approx(miss, abs=1e-6)
    assert probability(200, 0) == pytest.approx(most, abs=5e-4)
    assert probability(0, 400) == pytest.approx(least, abs=5e-4)


def test_hector_stops_at_fifty():
    assert (after("hector", 200, 0), after("hector", 0, 400)) == (50.0, -50.0)


@pytest.mark.parametrize(
    ("name", "hits", "misses", "sign"),
    [
        ("counting", 1, 0, 1),  # gmapping: occ_thresh 0.25, and one visit is enough
        ("counting", 0, 1, -1),
        ("counting", 1, 3, -1),
        ("counting", 1, 2, 1),
        ("karto", 2, 0, 0),  # Karto: OccupancyThreshold 0.1, and more visits than MinPassThrough, which is 2
        ("karto", 1, 1, 0),
        ("karto", 0, 2, 0),
        ("karto", 3, 0, 1),
        ("karto", 1, 2, 1),
        ("karto", 0, 3, -1),
        ("karto", 1, 9, -1),
        ("karto", 1, 8, 1),
    ],
)
def test_counting_models_follow_their_source(name, hits, misses, sign):
    assert np.sign(after(name, hits, misses)) == sign


@settings(max_examples=30)
@given(st.floats(-math.pi, math.pi), st.floats(-2, 2), st.floats(-2, 2))
def test_the_mounting_is_used(yaw, x, y):
    scan = scan_of(np.linspace(2.0, 5.0, 24))
    poses = Trajectory(np.array([0.0]), np.array([[1.0, 2.0, 0.5]]))
    mounting = SE2(x, y, yaw)
    mapped = map_log(RobotLog((scan,), poses, mounting), poses, 0.1)
    mapper = LogOddsMapper(0.1)
    mapper.integrate(scan, SE2(1.0, 2.0, 0.5) @ mounting)
    assert np.array_equal(mapped.log_odds, mapper.grid().log_odds)
    assert mapped.frame == mapper.grid().frame


@pytest.mark.parametrize("setting", [{"resolution": 0.0}, {"resolution": math.nan}, {"clear_range": -1.0}])
def test_bad_settings_are_refused(setting):
    with pytest.raises(ValueError, match=next(iter(setting))):
        LogOddsMapper(**setting)


def test_unknown_model_lists_the_presets():
    with pytest.raises(ValueError, match=r"octomap.*karto"):
        sensor_model("magic")
