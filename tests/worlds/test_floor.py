"""Worlds that cannot be explored are refused, with the reason and the place."""

from __future__ import annotations

import pytest

from mapping.geometry.se2 import SE2
from worlds.floor import find_floor, require_drivable
from worlds.polygon import Polygon, box
from worlds.world import World

FENCE = box(2, 2, 8, 4)


def walled(*inside: Polygon, starts: tuple[SE2, ...] = (), fence: Polygon | None = None, parts: int = 1) -> World:
    outer = (box(0, 0, 10, 0.2), box(0, 5.8, 10, 6), box(0, 0, 0.2, 6), box(9.8, 0, 10, 6))
    return World("w", 0, (10, 6), (*outer, *inside), starts, fence, parts)


def test_floor_is_measured_where_the_middle_of_a_robot_can_be() -> None:
    floor = find_floor(walled(), radius=0.3)
    assert floor.areas == (pytest.approx((9.6 - 0.6) * (5.6 - 0.6), rel=0.05),)
    assert floor.middle(1)[1] == pytest.approx(3.0, abs=0.1)


def test_a_wall_across_is_named_with_both_areas_and_where_they_are() -> None:
    with pytest.raises(ValueError, match=r"in 2 parts .* must be 1: 2\d\.\d m\^2 about .*, 1\d\.\d m\^2 about"):
        require_drivable(walled(box(6, 0, 6.2, 6)))
    assert require_drivable(walled(box(6, 0, 6.2, 6), parts=2)).parts == 2
    with pytest.raises(ValueError, match=r"in 1 parts .* must be 2"):
        require_drivable(walled(parts=2))


def test_a_door_too_narrow_for_the_robot_separates_the_floor() -> None:
    narrow, wide = (walled(box(6, 0, 6.2, 3), box(6, 3 + gap, 6.2, 6)) for gap in (0.4, 0.9))
    with pytest.raises(ValueError, match="2 parts"):
        require_drivable(narrow)
    assert require_drivable(wide) is wide


def test_a_gap_behind_an_obstacle_is_not_a_part() -> None:
    assert require_drivable(walled(box(0, 1, 1.2, 1.2), box(1.0, 0, 1.2, 1.2))).parts == 1


def test_a_full_world_and_a_huge_one_are_refused() -> None:
    with pytest.raises(ValueError, match="no free floor"):
        require_drivable(walled(box(0, 0, 10, 6)))
    with pytest.raises(ValueError, match="width is 501 m"):
        require_drivable(World("w", 0, (501, 5), ()))


def test_an_opening_to_the_outside_is_named_and_a_fence_closes_it() -> None:
    sides = (box(0, 0, 10, 0.2), box(0, 5.8, 10, 6), box(0, 0, 0.2, 6))
    with pytest.raises(ValueError, match=r"could leave its 10 x 6 m at \(9\.\d+, 0\.2\d\)"):
        require_drivable(World("w", 0, (10, 6), sides))
    fenced = World("w", 0, (10, 6), sides, fence=FENCE)
    assert require_drivable(fenced) is fenced
    assert find_floor(fenced).areas == (pytest.approx(5.6 * 1.6, rel=0.1),)


@pytest.mark.parametrize(
    ("start", "message"),
    [
        (SE2(5.0, 3.0, 0.0), r"start 1 at \(5, 3\) is in a wall"),
        (SE2(0.5, 3.0, 0.0), r"start 1 at \(0.5, 3\) stands 0.30 m clear"),
    ],
)
def test_a_start_in_a_wall_or_too_near_is_named(start: SE2, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        require_drivable(walled(box(4.5, 2.5, 5.5, 3.5), starts=(SE2(2.0, 2.0, 0.0), start)))


def test_a_start_outside_the_fence_is_refused() -> None:
    with pytest.raises(ValueError, match=r"start 0 at \(1, 1\) is outside the fence"):
        require_drivable(walled(starts=(SE2(1.0, 1.0, 0.0),), fence=FENCE))


def test_the_fence_counts_as_near_from_inside_and_as_zero_from_outside() -> None:
    world = walled(fence=FENCE)
    assert world.clearance([(3.0, 2.3), (1.0, 1.0), (5.0, 3.0)]) == pytest.approx([0.3, 0.0, 1.0])
