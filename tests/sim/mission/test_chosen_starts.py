"""Starts that are spread, close or given."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from sim.mission.settings import Starts
from sim.mission.starts import choose_starts
from sim.physics.robot import RobotSettings
from worlds.families.registry import make_world
from worlds.polygon import box
from worlds.world import World

TEAM = (RobotSettings(),) * 5


def gaps(starts: tuple[SE2, ...]) -> list[float]:
    return [math.dist((a.x, a.y), (b.x, b.y)) for a, b in combinations(starts, 2)]


def chosen(how: Starts, seed: int, robots: tuple[RobotSettings, ...] = TEAM) -> tuple[SE2, ...]:
    return choose_starts(np.random.default_rng(seed), make_world("office", seed), robots, how)


@pytest.mark.parametrize("how", ["random", "spread", "close"])
def test_all_starts_are_clear(how: Starts) -> None:
    for seed in range(3):
        starts = chosen(how, seed)
        assert make_world("office", seed).clearance([(start.x, start.y) for start in starts]).min() >= 0.5
        assert min(gaps(starts)) >= 1.0


@pytest.mark.slow
def test_spread_is_farther_than_random_and_close_is_nearer() -> None:
    for seed in range(3):
        nearest = {how: min(gaps(chosen(how, seed))) for how in ("random", "spread")}
        assert nearest["spread"] > 1.5 * nearest["random"]
        assert nearest["spread"] > 9.0
        assert max(gaps(chosen("close", seed))) < 4.5


def test_close_starts_keep_a_gap_if_there_is_room() -> None:
    """Ways on a grid of eight neighbours exceed the distance by at most 8.3 %."""
    hall = World("hall", 0, (30, 20), ())
    for gap in (3.0, 6.0):
        starts = choose_starts(np.random.default_rng(1), hall, TEAM[:3], "close", gap)
        assert min(gaps(starts)) >= gap / 1.083
        assert gaps(starts)[0] <= gap + 0.1
    far = choose_starts(np.random.default_rng(1), hall, TEAM[:2], "close", 100.0)
    assert gaps(far)[0] > 15.0


def test_close_robots_are_not_separated_by_a_wall() -> None:
    wall = World("wall", 0, (20, 8), (box(9.9, 0, 10.1, 7),))
    for seed in range(8):
        starts = choose_starts(np.random.default_rng(seed), wall, TEAM[:4], "close")
        sides = {start.x > 10.0 for start in starts if start.y < 5.0}
        assert len(sides) < 2


def test_given_starts_are_kept_and_the_others_keep_away() -> None:
    given = SE2(15.0, 10.0, 0.7)
    world = World("hall", 0, (30, 20), ())
    for how in ("random", "spread", "close"):
        team = (RobotSettings(), RobotSettings(start=given), RobotSettings())
        starts = choose_starts(np.random.default_rng(1), world, team, how)  # type: ignore[arg-type]
        assert starts[1] == given
        assert min(gaps(starts)) >= 1.0


@pytest.mark.parametrize(
    ("starts", "message"),
    [
        ([SE2(4.1, 1.0)], r"start 0 at \(4.1, 1\) is in a wall of world 'two rooms'"),
        ([SE2(0.3, 1.0)], r"start 0 at \(0.3, 1\) is 0.10 m from a wall"),
        ([SE2(1, 1), SE2(1.3, 1)], r"start 1 at \(1.3, 1\) overlaps start 0 at \(1, 1\): 0.30 m apart"),
        ([SE2(1, 1), SE2(9, 1)], r"start 1 at \(9, 1\) is outside world 'two rooms' of 8 x 5 m"),
    ],
)
def test_bad_starts_are_refused_with_what_and_where(two_rooms: World, starts: list[SE2], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        choose_starts(np.random.default_rng(0), two_rooms, [RobotSettings(start=start) for start in starts])


@pytest.mark.parametrize("how", ["random", "spread", "close"])
def test_more_than_fit_are_refused(two_rooms: World, how: Starts) -> None:
    with pytest.raises(ValueError, match=r"robots is 60, .*'two rooms' .* for \d+ only"):
        choose_starts(np.random.default_rng(0), two_rooms, (RobotSettings(),) * 60, how)
