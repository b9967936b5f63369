"""Measure Snap from rough placements: ``python docs/align_snap.py [--most N] PAIRS.json [DATASET...]``.

Each pair with exactly one right answer is placed 2 m (40 cells without a resolution) and 15 degrees off, about the
middle of its walls and in a random direction, at its true scale, and snapped. Pairs that the merger refuses are counted
apart. With ``--most``, N of the pairs are drawn from each source at equal chances.
"""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet
from mapquilt.align.arrangement import Placement
from mapquilt.align.workspace import AlignTask, Workspace
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.pair_list import read_pair_list
from mapquilt.benchmark.pair_sets import dataset_pairs
from mapquilt.evaluation.evaluated_pair import evaluate_pair
from mapquilt.evaluation.transform_error import RIGHT_PLACE
from mapquilt.merging.merge_inputs import MergeInputs
from merge.settings import MergeSettings

SHIFT_M, SHIFT_CELLS, TURN = 2.0, 40.0, math.radians(15.0)


@dataclass(frozen=True)
class Outcome:
    """Outcome of one pair: refused by the merger; its maps distorted, so that no transform fits them well; snapped
    within the criterion; at the right place, if less precisely; and the snap accepted."""

    refused: bool
    distorted: bool
    right: bool
    right_place: bool
    accepted: bool


def main(sources: list[Path], most: int | None) -> None:
    rng = np.random.default_rng(0)
    outcomes = []
    for source in sources:
        found = dataset_pairs(source, None) if source.is_dir() else read_pair_list(source)
        pairs = [pair for pair in found if pair.truth.identifiable]
        if most is not None and most < len(pairs):
            pairs = [pairs[index] for index in rng.permutation(len(pairs))[:most]]
        for pair in pairs:
            outcome = snapped(pair, rng)
            outcomes.append(outcome)
            sys.stdout.write(f"{pair.info.suite} {pair.info.name}: {outcome}\n")
            sys.stdout.flush()
    refused = [each for each in outcomes if each.refused]
    undistorted = [each for each in refused if not each.distorted]
    for title, chosen in (("refused, not distorted", undistorted), ("refused", refused), ("all", outcomes)):
        counts = [sum(getattr(each, name) for each in chosen) for name in ("right", "right_place", "accepted")]
        wrong = sum(each.accepted and not each.right_place for each in chosen)
        sys.stdout.write(
            f"{title}: {len(chosen)} pairs, {counts[0]} right, {counts[1]} at the right place, {counts[2]} accepted, "
            f"{wrong} of these at a wrong place\n"
        )


def snapped(pair: BenchmarkPair, rng: np.random.Generator) -> Outcome:
    """Place a pair roughly, snap it, and compare it with the truth."""
    maps = pair.maps()
    truths = pair.metric_truth(maps)
    truth = truths.target_from_source
    assert truth is not None
    workspace = Workspace(AlignTask(inputs_of(maps), MergeSettings(), 0, Path("aligned"), ()))
    refused = not workspace.candidates(1, 0)[0].accepted
    start = rough(truth, workspace.measurer.wall_points(1).mean(axis=0).tolist(), maps, rng)
    sheet = workspace.arrangement.placements[0].sheet_from_map
    workspace.change(workspace.arrangement.placed(1, Placement(sheet @ start, "hand")))
    answer = workspace.snap(1, 0)
    placed = replace(answer, target_from_source=workspace.arrangement.target_from_source(0, 1), covariance=None)
    one = evaluate_pair(*maps.grids, truths, placed, pair=pair.info, method="snap")
    assert one.error is not None
    return Outcome(refused, bool(one.distorted), one.right, RIGHT_PLACE.holds(one.error), answer.accepted)


def inputs_of(maps: MapSet) -> MergeInputs:
    return MergeInputs(maps, maps.names, (None,) * len(maps))


def rough(truth: Similarity2, middle: list[float], maps: MapSet, rng: np.random.Generator) -> Similarity2:
    """Move the true placement by the shift in a random direction, and turn it either way."""
    direction, side = rng.uniform(0.0, math.tau), rng.choice([-1.0, 1.0])
    length = SHIFT_M if maps.units[0] == "m" else SHIFT_CELLS * maps.grids[0].frame.resolution
    shift = Similarity2(length * math.cos(direction), length * math.sin(direction))
    return shift @ Similarity2(yaw=side * TURN).about(truth.apply(middle)) @ truth


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sources", nargs="+", type=Path)
    parser.add_argument("--most", type=int, help="pairs of a source at most; all if not given")
    given = parser.parse_args()
    main(given.sources, given.most)
