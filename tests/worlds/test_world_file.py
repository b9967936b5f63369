"""World files: exact there and back, and what they refuse."""

from __future__ import annotations

import json

import numpy as np
import pytest

from worlds.families import make_world
from worlds.polygon import turned_box
from worlds.world import World
from worlds.world_file import world_from_json, world_to_json


def test_a_world_comes_back_bit_for_bit_through_text() -> None:
    for world in (
        make_world("office", 2),
        World("box", 3, (0.1 + 0.2, 1 / 3), (turned_box(0.15, 0.15, 0.1, 0.1, 0.3),)),
    ):
        again = world_from_json(json.loads(json.dumps(world_to_json(world))))
        assert again == world
        assert all(np.array_equal(a, b) for a, b in zip(again.obstacles, world.obstacles, strict=True))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": "other"}, "'other'"),
        ({"version": 99}, "version is 99"),
        ({"size": None}, "NoneType"),
        ({"size": [1.0]}, "values to unpack"),
        ({"obstacles": [[[0, 0], [1, 1]]]}, "three corners"),
        ({"obstacles": [["x"]]}, "could not convert"),
    ],
)
def test_bad_records_are_refused(change: dict[str, object], message: str) -> None:
    record = world_to_json(World("w", 0, (1.0, 1.0), ()))
    with pytest.raises(ValueError, match=message):
        world_from_json({**record, **change})


@pytest.mark.parametrize("name", ["name", "seed", "size", "obstacles"])
def test_a_missing_field_is_named(name: str) -> None:
    record = world_to_json(World("w", 0, (1.0, 1.0), ()))
    del record[name]
    with pytest.raises(ValueError, match=f"{name} is missing"):
        world_from_json(record)
