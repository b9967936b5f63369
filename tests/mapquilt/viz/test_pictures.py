"""Pictures of pairs: positions of the walls, and order of the pairs."""

import pytest
from matplotlib.colors import to_rgb

from mapping.geometry.similarity2 import Similarity2
from mapquilt.viz.pair_card import GAP, SIDE, card_picture
from mapquilt.viz.pair_sheet import most_relevant_first
from mapquilt.viz.palette import ROBOTS, WALL
from tests.mapquilt.evaluation.examples import BAD, GOOD, evaluated
from tests.merge.literature.crisp import crisp_pair


def shares(card):
    """Count the pixels of the overlay that show target walls alone, source walls alone, and both."""
    overlay = card[:, -SIDE:].reshape(-1, 3)
    colours = (*(tuple(round(255 * part) for part in to_rgb(ROBOTS[k])) for k in (0, 1)), WALL)
    return [int((overlay == colour).all(axis=1).sum()) for colour in colours]


def test_walls_fall_on_walls_in_the_overlay_of_the_truth_alone():
    target, source, truth = crisp_pair()
    frames = [Similarity2.from_se2(one.grid.frame.origin, one.grid.frame.resolution) for one in (target, source)]
    metres = frames[0] @ truth @ frames[1].inverse()
    right = card_picture(target.grid, source.grid, metres, metres)
    wrong = card_picture(target.grid, source.grid, Similarity2(0.7, 0.7) @ metres, metres)
    assert right.shape == (SIDE, 3 * SIDE + 2 * GAP, 3)
    assert shares(right)[2] > 3 * shares(wrong)[2]
    assert shares(right)[1] < shares(wrong)[1]


def test_without_an_answer_only_the_target_is_drawn():
    target, source, _ = crisp_pair()
    alone, beside, both = shares(card_picture(target.grid, source.grid, None, None))
    assert alone > 0
    assert beside == both == 0


def test_errors_come_first():
    pairs = [
        evaluated(True, GOOD, 0.9),
        evaluated(False, None, 0.1, negative=True),
        evaluated(False, GOOD, 0.4),
        evaluated(True, BAD, 0.6),
        evaluated(True, None, 0.8, negative=True),
        evaluated(False, BAD, 0.2),
        evaluated(False, None, 0.0),
        evaluated(False, BAD, 0.05, identifiable=False),
        evaluated(True, BAD, 0.55, identifiable=False),
    ]
    assert most_relevant_first(pairs)[pairs[0].method] == [4, 3, 8, 5, 6, 2, 0, 1, 7]


@pytest.mark.parametrize("scale", [1e-12, 1e-3, 1e3, 1e12])
@pytest.mark.filterwarnings("error")
def test_the_overlay_of_a_far_answer_still_shows_the_target(scale):
    target, source, truth = crisp_pair()
    card = card_picture(target.grid, source.grid, Similarity2(1e6, -1e6, 1.0, scale), truth)
    assert shares(card)[0] > 50
