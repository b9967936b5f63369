"""Synthetic teams with injected wrong answers."""

import numpy as np
import pytest

from benchmarks.team_injection.injection import inject
from benchmarks.team_injection.trials import averaged, drawn, injection_trial
from mapping.geometry.similarity2 import Similarity2
from mapquilt.evaluation.transform_error import RIGHT, transform_error
from merge.verification.cell_overlap import compare_cells


def test_the_truth_of_a_drawn_team_aligns_its_maps():
    """Two maps agree cell by cell at the truth, and disagree half a metre away from it."""
    _, team = drawn(1, maps=2)
    target, source = team.maps.grids
    bare = [Similarity2.from_se2(grid.frame.origin, grid.frame.resolution) for grid in (target, source)]

    def agreeing(move):
        cells = bare[0].inverse() @ move @ team.truth(0, 1) @ bare[1]
        return compare_cells(target, source, cells).acceptance_index

    size = team.world_from_map[0].scale
    assert agreeing(Similarity2()) > 0.93
    assert agreeing(Similarity2()) > agreeing(Similarity2(0.6 / size, 0.6 / size)) + 0.02


def test_injected_answers_are_right_or_wrong_as_labelled():
    _, team = drawn(3, maps=6)
    injected = inject(team, 0.3, np.random.default_rng(0))
    names = team.maps.names
    assert len(injected.wrong) == round(0.3 * len(injected.pairs))
    for pair in injected.pairs:
        a, b = names.index(pair.target), names.index(pair.source)
        error = transform_error(team.maps.grids[a], team.maps.grids[b], team.truth(a, b), pair.target_from_source)
        wrong = (pair.target, pair.source) in injected.wrong
        if error.displacement_m is not None:
            assert RIGHT.holds(error) is not wrong


@pytest.mark.parametrize("seed", [1, 3, 7, 15])
def test_wrong_answers_are_rejected_and_no_map_is_lost(seed):
    trial = injection_trial(seed, maps=6)
    assert trial is not None and trial.wrong >= 2
    assert (trial.wrong_kept, trial.maps_lost) == (0, 0)


def test_motion_averaging_chooses_among_the_same_answers():
    trial, other = injection_trial(3, maps=6), injection_trial(3, maps=6, keep=averaged)
    assert (other.world, other.maps, other.edges, other.wrong) == (trial.world, trial.maps, trial.edges, trial.wrong)
    assert other.wrong_kept < other.wrong
    assert other.maps_lost == 0
