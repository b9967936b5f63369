"""Cards and sheets: what lies where, and what comes first."""

import pytest
from matplotlib.colors import to_rgb

from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet
from mapquilt.viz.pair_card import GAP, SIDE, card_picture
from mapquilt.viz.pair_sheet import in_order, outcome
from mapquilt.viz.palette import ROBOTS, WALL
from tests.mapquilt.benchmark.made import BAD, GOOD, answer, pair, trial
from tests.merge.literature.crisp import crisp_pair


def shares(card):
    """How many pixels of the overlay show target walls alone, source walls alone, and both."""
    overlay = card[:, -SIDE:].reshape(-1, 3)
    colours = (*(tuple(round(255 * part) for part in to_rgb(ROBOTS[k])) for k in (0, 1)), WALL)
    return [int((overlay == colour).all(axis=1).sum()) for colour in colours]


def test_walls_fall_on_walls_in_the_overlay_of_the_truth_alone():
    target, source, truth = crisp_pair()
    maps = MapSet(("a", "b"), (target.grid, source.grid), ("m", "m"))
    frames = [Similarity2.from_se2(grid.frame.origin, grid.frame.resolution) for grid in maps.grids]
    metres = frames[0] @ truth @ frames[1].inverse()
    right = card_picture(maps, metres, metres)
    wrong = card_picture(maps, Similarity2(0.7, 0.7) @ metres, metres)
    assert right.shape == (SIDE, 3 * SIDE + 2 * GAP, 3)
    assert shares(right)[2] > 3 * shares(wrong)[2]
    assert shares(right)[1] < shares(wrong)[1]


def test_without_an_answer_the_target_stands_alone():
    target, source, _ = crisp_pair()
    maps = MapSet(("a", "b"), (target.grid, source.grid), ("m", "m"))
    alone, beside, both = shares(card_picture(maps, None, None))
    assert alone > 0
    assert beside == both == 0


def test_what_went_wrong_comes_first():
    told = [
        (False, True, GOOD, 0.9, "right, accepted"),
        (True, False, None, 0.1, "to be refused, refused"),
        (False, False, GOOD, 0.4, "right, but refused"),
        (False, True, BAD, 0.6, "wrong, and accepted"),
        (True, True, None, 0.8, "to be refused, and accepted"),
        (False, False, BAD, 0.2, "wrong, refused"),
        (False, False, None, 0.0, "wrong, refused"),
        (None, False, BAD, 0.05, "not identifiable, refused"),
        (None, True, BAD, 0.55, "wrong, and accepted"),
    ]
    trials = [
        trial(pair(negative=n is True, identifiable=n is False), answer(a, error, said))
        for n, a, error, said, _ in told
    ]
    assert [outcome(t, t.answers[0]).words for t in trials] == [words for *_, words in told]
    assert [trials.index(t) for t in in_order(trials, 0)] == [4, 3, 8, 5, 6, 2, 0, 1, 7]


@pytest.mark.parametrize("scale", [1e-12, 1e-3, 1e3, 1e12])
@pytest.mark.filterwarnings("error")
def test_the_overlay_of_an_absurd_answer_still_shows_the_target(scale):
    target, source, truth = crisp_pair()
    maps = MapSet(("a", "b"), (target.grid, source.grid), ("m", "m"))
    card = card_picture(maps, Similarity2(1e6, -1e6, 1.0, scale), truth)
    assert shares(card)[0] > 50
