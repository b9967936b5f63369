"""World files: exact round trips and refusals."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from worlds.families.registry import make_world
from worlds.polygon import signed_area, turned_box
from worlds.world import World
from worlds.world_file import world_from_json, world_to_json


def test_a_world_round_trip_is_exact() -> None:
    for world in (
        make_world("office", 2),
        make_world("outdoor", 2),
        make_world("thesis_hall", 0),
        make_world("disjoint", 1),
        World("box", 3, (0.1 + 0.2, 1 / 3), (turned_box(0.15, 0.15, 0.1, 0.1, 0.3),)),
    ):
        again = world_from_json(json.loads(json.dumps(world_to_json(world))))
        assert again == world
        assert all(np.array_equal(a, b) for a, b in zip(again.obstacles, world.obstacles, strict=True))
        assert (again.starts, again.parts) == (world.starts, world.parts)


def test_boxes_and_cylinders_become_polygons() -> None:
    record = {
        "schema": "mapquilt-world/1",
        "size": [10, 8],
        "polygons": [[[1, 1], [1, 2], [2, 2]]],
        "boxes": [{"centre": [5, 4], "size": [2, 1], "yaw": 0.5}],
        "cylinders": [{"centre": [8, 2], "radius": 0.5}],
        "starts": [{"x": 3, "y": 3}],
    }
    world = world_from_json(record, "by hand")
    clockwise, box, cylinder = world.obstacles
    assert (world.name, world.seed, world.size) == ("by hand", 0, (10.0, 8.0))
    assert signed_area(clockwise) == pytest.approx(0.5)
    assert np.array_equal(box, turned_box(5.0, 4.0, 2.0, 1.0, 0.5))
    assert np.hypot(*(cylinder - (8, 2)).T) == pytest.approx(0.5)
    assert signed_area(cylinder) == pytest.approx(math.pi * 0.25, rel=0.01)
    assert world.starts == (SE2(3.0, 3.0, 0.0),)


BOW_TIE = [[0.1, 0.1], [0.9, 0.9], [0.9, 0.1], [0.1, 0.8]]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": "other"}, "'other'"),
        ({"schema": "mapquilt-world/99"}, "world/99"),
        ({"size": None}, "size is missing"),
        ({"size": [1.0]}, "values to unpack"),
        ({"size": [1.0, math.nan]}, "height is nan"),
        ({"polygons": [[[0, 0], [1, 1]]]}, r"polygons\[0\].*three corners"),
        ({"polygons": [["x"]]}, r"polygons\[0\].*could not convert"),
        ({"polygons": [BOW_TIE]}, "obstacle 0 crosses"),
        ({"polygons": [[[0, 0], [1, 0], [1, math.nan]]]}, "not finite"),
        ({"boxes": [{"centre": [0.5, 0.5], "size": [0.1, 0.0]}]}, r"boxes\[0\].size is 0"),
        ({"boxes": [{"size": [0.1, 0.1]}]}, "centre is missing"),
        ({"cylinders": [{"centre": [0.5, 0.5], "radius": -1}]}, r"cylinders\[0\].radius is -1"),
        ({"cylinders": [{"centre": [0.5, math.inf], "radius": 1}]}, r"cylinders\[0\].*not finite"),
        ({"starts": [{"x": 0.5, "y": math.nan}]}, r"starts\[0\].*not finite"),
        ({"fence": BOW_TIE}, "fence crosses"),
        ({"parts": 0}, "parts is 0"),
    ],
)
def test_bad_records_are_refused(change: dict[str, object], message: str) -> None:
    record = world_to_json(World("w", 0, (1.0, 1.0), ()))
    with pytest.raises(ValueError, match=message):
        world_from_json({**record, **change})


@pytest.mark.parametrize("name", ["name", "size"])
def test_a_missing_field_is_named(name: str) -> None:
    record = world_to_json(World("w", 0, (1.0, 1.0), ()))
    del record[name]
    with pytest.raises(ValueError, match=f"{name} is missing"):
        world_from_json(record)
