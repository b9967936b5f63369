"""Beams pass glass at an angle and return from what is behind."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sim.sensors.adversity.glass import GlassWalls, glaze, see_through
from sim.sensors.adversity.settings import Adversity
from worlds.families.registry import make_world
from worlds.polygon import box
from worlds.world import World

GLASS = Adversity(glass=1.0)


def facing(*solids) -> World:
    """A wall of 0.2 m at x = 10, seen from (0, 4), and what is behind it."""
    return World("glass", 0, (30.0, 40.0), (box(10, 0, 10.2, 40), *solids))


def read(world: World, degrees: float, distance: float, adversity: Adversity = GLASS) -> float:
    direction = np.array([(math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))])
    return float(see_through(glaze(world, adversity, 1), np.array((0.0, 4.0)), direction, np.array([distance]))[0])


def test_glass_returns_a_beam_along_its_normal_and_lets_one_at_80_degrees_pass() -> None:
    at_60 = 10.0 / math.cos(math.radians(60.0))
    assert read(facing(), 0.0, 10.0) == 10.0
    assert read(facing(), 60.0, at_60) == math.inf
    behind = facing(box(20, 0, 21, 40))
    assert read(behind, 60.0, at_60) == pytest.approx(2.0 * at_60)
    steep = World("steep", 0, (30.0, 40.0), (box(1, 0, 1.2, 40), box(2, 0, 3, 40)))
    assert read(steep, 80.0, 1.0 / math.cos(math.radians(80.0))) == pytest.approx(2.0 / math.cos(math.radians(80.0)))
    assert read(steep, 0.0, 1.0) == 1.0


def test_the_angle_of_incidence_decides() -> None:
    for degrees, passes in ((14.9, False), (15.1, True), (-14.9, False), (-15.1, True)):
        distance = 10.0 / math.cos(math.radians(degrees))
        assert (read(facing(), degrees, distance) != distance) == passes


def test_a_thick_solid_shows_nothing_behind_its_glass() -> None:
    thick = World("thick", 0, (30.0, 40.0), (box(10, 0, 11, 40), box(20, 0, 21, 40)))
    assert read(thick, 40.0, 10.0 / math.cos(math.radians(40.0))) == math.inf


def test_a_solid_that_touches_the_pane_is_seen() -> None:
    distance = 10.0 / math.cos(math.radians(40.0))
    assert read(facing(box(10.2, 0, 12, 40)), 40.0, distance) == pytest.approx(10.2 / math.cos(math.radians(40.0)))


def test_beams_that_end_elsewhere_are_left_alone() -> None:
    for distance in (5.0, math.inf, -math.inf):
        assert read(facing(), 40.0, distance) == distance
    assert read(facing(), 40.0, 10.0 / math.cos(math.radians(40.0)), Adversity()) == 10.0 / math.cos(math.radians(40.0))


def lengths(glass: GlassWalls) -> float:
    return float(np.hypot(*(glass.panes[:, 1] - glass.panes[:, 0]).T).sum())


def test_a_thin_wall_is_of_glass_on_both_sides() -> None:
    panes = glaze(facing(), Adversity(glass=0.5), 3).panes
    spans = [{tuple(sorted(pane[:, 1].round(6))) for pane in panes if pane[0, 0] == x} for x in (10.0, 10.2)]
    assert spans[0] == spans[1]
    assert 0 < len(spans[0]) < 27


def test_a_share_of_the_walls_is_of_glass_and_a_lower_share_is_among_it() -> None:
    world = make_world("office", 1)
    whole = lengths(glaze(world, GLASS, 1))
    shares = [
        np.mean([lengths(glaze(world, Adversity(glass=share), seed)) for seed in range(20)]) for share in (0.1, 0.4)
    ]
    assert np.array(shares) / whole == pytest.approx((0.1, 0.4), rel=0.15)
    few, more = ({pane.tobytes() for pane in glaze(world, Adversity(glass=share), 7).panes} for share in (0.1, 0.4))
    assert few < more
    assert not len(glaze(world, Adversity(), 7).panes)
    assert not len(glaze(World("empty", 0, (5.0, 5.0), ()), GLASS, 7).panes)
