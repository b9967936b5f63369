"""Times at which cells were observed, coverage over time, and missions cut to an overlap."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.ground_truth.footprint import observed
from mapping.ground_truth.truth import overlap
from sim.mission.coverage import coverage
from sim.mission.first_seen import NEVER, first_seen
from sim.mission.mission import Mission
from sim.mission.overlap import StartAttempt, cut_to_overlap, start_attempts
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.physics.robot import RobotSettings
from worlds.families.registry import make_world
from worlds.polygon import box, disc
from worlds.raster import touched_cells, true_raster
from worlds.world import World


@pytest.fixture(scope="module")
def long_mission() -> Mission:
    return simulate(make_world("office", 2), MissionSettings(3, 40.0, starts="close"), 2)[0]


@pytest.mark.parametrize("scans", [1, 40, 121])
def test_cells_seen_after_some_scans_are_those_that_the_scans_observe(mission: Mission, scans: int) -> None:
    frame = true_raster(mission.world).frame
    truth = mission.robots[1]
    assert ((first_seen(truth, frame) <= scans) != observed(truth.part(0, scans), frame)).mean() < 1e-5


def test_cells_cleared_by_beams_without_a_return_are_observed() -> None:
    trees = tuple(disc(x, y, 0.3, 12) for x in (2.0, 7.0, 12.0) for y in (2.0, 7.0, 12.0))
    park = World("park", 0, (14.0, 14.0), trees, fence=box(1.0, 1.0, 13.0, 13.0))
    mission, _ = simulate(park, MissionSettings(1, 1.0), 1)
    raster = true_raster(park)
    for clear_range in (0.0, 3.0, 100.0):
        maps = [observed(truth, raster.frame, clear_range) for truth in mission.robots]
        firsts = [first_seen(truth, raster.frame, clear_range) for truth in mission.robots]
        assert all(np.array_equal(a, b < NEVER) for a, b in zip(maps, firsts, strict=True))
        fenced = maps[0] & raster.free & touched_cells([box(1.0, 1.0, 13.0, 13.0)], 0.05, raster.frame.shape)
        assert coverage(mission, clear_range).team[-1] * coverage(mission).free_area == pytest.approx(
            fenced.sum() * 0.05**2
        )


def test_the_reached_overlap_includes_beams_without_a_return() -> None:
    world, settings = make_world("outdoor", 1, 15.0, 15.0), MissionSettings(2, 8.0, overlap=(0.6, 0.8))
    mission, _ = simulate(world, settings, 1, clear_range=12.0)
    frame = true_raster(world).frame
    assert 0.6 <= overlap(*(observed(truth, frame, 12.0) for truth in mission.robots)) <= 0.8
    assert not 0.6 <= overlap(*(observed(truth, frame) for truth in mission.robots)) <= 0.8


def test_coverage_grows_to_what_the_robots_observed(mission: Mission) -> None:
    seen, raster = coverage(mission), true_raster(mission.world)
    assert seen.stamps.tolist() == [*map(float, range(13))]
    assert (np.diff(seen.robots, axis=1) >= 0.0).all()
    assert (seen.team >= seen.robots.max(axis=0)).all()
    assert (seen.team <= seen.robots.sum(axis=0) + 1e-12).all()
    maps = [observed(truth, raster.frame) & raster.free for truth in mission.robots]
    assert seen.robots[:, -1] == pytest.approx([each.sum() / raster.free.sum() for each in maps], abs=1e-4)
    assert seen.team[-1] == pytest.approx(np.logical_or.reduce(maps).sum() / raster.free.sum(), abs=1e-4)
    assert seen.free_area == pytest.approx(raster.free.sum() * 0.0025)


@pytest.mark.slow
@pytest.mark.parametrize("wanted", [(0.5, 0.7), (0.75, 0.95)])
def test_a_cut_mission_has_the_requested_overlap(long_mission: Mission, wanted: tuple[float, float]) -> None:
    frame = true_raster(long_mission.world).frame
    cut = cut_to_overlap(long_mission.robots, frame, wanted)
    short = long_mission.cut(cut.scans)
    maps = [observed(truth, frame) for truth in short.robots]
    reached = [overlap(a, b) for a, b in combinations(maps, 2)]
    if cut.error == 0.0:
        assert wanted[0] <= min(reached) <= max(reached) <= wanted[1]
    missed = sum(max(0.0, wanted[0] - each, each - wanted[1]) for each in reached)
    assert missed == pytest.approx(cut.error, abs=0.02)
    assert tuple(len(truth.scans) for truth in short.robots) == cut.scans


def test_nothing_is_cut_if_any_overlap_is_allowed(long_mission: Mission) -> None:
    frame = true_raster(long_mission.world).frame
    cut = cut_to_overlap(long_mission.robots, frame, (0.0, 1.0))
    assert (cut.scans, cut.error) == ((401, 401, 401), 0.0)


def test_the_best_ends_of_two_robots_equal_an_exhaustive_search(long_mission: Mission) -> None:
    """Compared with every pair of ends, by footprints."""
    frame = true_raster(long_mission.world).frame
    pair, wanted = long_mission.robots[:2], (0.4, 0.45)
    counts = np.maximum(1, np.rint(401 * np.linspace(0.05, 1.0, 60))).astype(int)
    seen = [first_seen(truth, frame) for truth in pair]
    maps = [[each <= count for count in counts[::6]] for each in seen]
    least = min(max(0.0, 0.4 - share, share - 0.45) for a in maps[0] for b in maps[1] for share in (overlap(a, b),))
    assert cut_to_overlap(pair, frame, wanted).error <= least + 0.01
    assert all((each == NEVER).any() for each in seen)


@pytest.mark.slow
def test_an_overlap_is_reached_by_other_starts_or_the_nearest_is_kept() -> None:
    world = make_world("office", 7)
    starts = (RobotSettings(start=SE2(3.0, 10.0, 0.0)), RobotSettings())
    settings = MissionSettings(starts, 10.0, overlap=(0.6, 0.9))
    mission, times = simulate(world, settings, 7)
    frame = true_raster(world).frame
    assert 0.6 <= overlap(*(observed(truth, frame) for truth in mission.robots)) <= 0.9
    assert times.cutting > 0.0
    out_of_reach, _ = simulate(world, MissionSettings(3, 2.0, overlap=(0.01, 0.02)), 7)
    assert len(out_of_reach.robots) == 3


def test_close_starts_are_tried_first_for_large_overlaps() -> None:
    much, little = (start_attempts(MissionSettings(2, overlap=wanted)) for wanted in ((0.7, 0.9), (0.0, 0.2)))
    found = [[(each.settings.starts, each.draw) for each in attempts] for attempts in (much, little)]
    further = [("close", draw) for draw in (1, 2, 3)]
    assert found[0] == [("random", 0), ("close", 0), ("spread", 0), *further]
    assert found[1] == [("random", 0), ("spread", 0), ("close", 0), *further]
    assert start_attempts(MissionSettings(2)) == (StartAttempt(MissionSettings(2)),)


@pytest.mark.slow
def test_close_starts_stay_close_and_reach_an_overlap_further_apart() -> None:
    world = make_world("office", 6)
    mission, _ = simulate(world, MissionSettings(2, 30.0, starts="close", overlap=(0.3, 0.5)), 6)
    frame = true_raster(world).frame
    assert 0.3 <= overlap(*(observed(truth, frame) for truth in mission.robots)) <= 0.5
    assert mission.settings.starts == "close"
    (x0, y0), (x1, y1) = ((pose.x, pose.y) for pose in (truth.trajectory.pose(0) for truth in mission.robots))
    assert np.hypot(x1 - x0, y1 - y0) <= 12.0
