import math

import numpy as np

from mapping.geometry.similarity2 import Similarity2
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.second_best import second_best_proposals
from tests.merge.rooms import CELL, equal_rooms, hall, observed, viewpoints


def off(proposals, truth, points):
    return min(np.hypot(*(p.target_from_source.apply(points) - truth.apply(points)).T).mean() for p in proposals)


def test_an_adjacent_equal_room_is_found_as_second_best():
    world, rng = equal_rooms(), np.random.default_rng(0)
    part = viewpoints(world, rng, (4.3, 0.3), (19.5, 11.7), number=30)
    prepared = PreparedMap(observed(world, part, Similarity2(), rng))
    pitch = 4.0 / CELL
    proposals = second_best_proposals(prepared, prepared, Similarity2.identity())
    for shift in (pitch, -pitch):
        assert off(proposals, Similarity2(shift), prepared.points) < 4.0


def test_a_symmetric_hall_has_a_second_best_at_half_a_turn():
    world, rng = hall(), np.random.default_rng(1)
    grid = observed(world, viewpoints(world, rng, (0.3, 0.3), (13.7, 8.7), number=30), Similarity2(), rng)
    prepared = PreparedMap(grid)
    low, high = prepared.points.min(axis=0), prepared.points.max(axis=0)
    half_turn = Similarity2(*(low + high), math.pi)
    assert off(second_best_proposals(prepared, prepared, Similarity2.identity()), half_turn, prepared.points) < 4.0
