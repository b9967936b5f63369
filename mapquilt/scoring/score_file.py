"""Score a run on disk, and write the score and its picture."""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import load_map
from mapping.io.transaction import change_files
from mapping.map_set import MapSet
from mapquilt.evaluation.evaluated_pair import PairInfo
from mapquilt.evaluation.pair_rows import to_row
from mapquilt.evaluation.transform_error import THESIS
from mapquilt.json_file import record_bytes
from mapquilt.merging.merge_file import GroupRecord, MergeAnswer, load_answer
from mapquilt.runs import folder as run_folder
from mapquilt.runs.truth_file import RunTruth, load_truth
from mapquilt.scoring.run_score import RunScore, evaluate_run_pair, score_merged_map
from mapquilt.viz.png import figure_png
from merge.records.result import PairResult

SCHEMA = "mapquilt-score/2"


def score_run(run: Path) -> RunScore:
    """Evaluate a run's merge against its truth, and write score.json and overview.png, both or neither."""
    from mapquilt.scoring.overview import overview_figure
    from mapquilt.scoring.true_scene import load_scene

    maps, timings = run_folder.load_maps(run), run_folder.read_timings(run)
    merge_path = run / run_folder.MERGE_FILE
    if not merge_path.exists():
        raise ValueError(f"{merge_path}: no such file; run `mapquilt merge {run}` first")
    answer, truth = load_answer(merge_path), load_truth(run / run_folder.TRUTH_FILE)
    answer = answer.without_added()
    _check_of_one_run(run, maps, answer, truth)
    start = time.perf_counter()
    groups = _merged_groups(run, answer)
    world, footprints = run_folder.true_rasters(run, maps)
    merged = tuple(
        score_merged_map(
            maps=maps,
            truth=truth,
            reference_from_map=group.reference_from_map,
            reference=group.reference,
            merged=grid,
            world=world,
            footprints={name: footprints[name] for name in group.reference_from_map},
        )
        for group, grid in groups
    )
    pairs = tuple(evaluate_run_pair(maps, truth, pair, _info(pair), answer.method) for pair in answer.pairs)
    score = RunScore(pairs, merged)
    scored = time.perf_counter() - start
    figure = overview_figure(load_scene(run, world), maps, truth, groups, score)
    score_path = run / run_folder.SCORE_FILE
    files = {score_path: score_bytes(score_path, score), run / run_folder.OVERVIEW_PICTURE: figure_png(figure)}
    seconds = {"score": scored, "draw": time.perf_counter() - start - scored}
    change_files(run, files | run_folder.timings_file(run, timings, "score", seconds), (), ledger=True)
    return score


def _info(pair: PairResult) -> PairInfo:
    return PairInfo(f"{pair.target} and {pair.source}", pair.target, pair.source)


def _merged_groups(run: Path, answer: MergeAnswer) -> list[tuple[GroupRecord, OccupancyGrid]]:
    """Load the merged map of each group that has one."""
    return [
        (group, load_map(run / f"{group.merged}.yaml").grid)
        for group in answer.groups
        if group.merged is not None and group.reference_from_map
    ]


def _check_of_one_run(run: Path, maps: MapSet, answer: MergeAnswer, truth: RunTruth) -> None:
    known = [robot.name for robot in truth.robots]
    for name in maps.names:
        if known.count(name) != 1:
            raise ValueError(
                f"{run / run_folder.TRUTH_FILE}: has the map {name!r} {known.count(name)} times, must be once"
            )
    for name in (
        *({answer.reference} - answer.added),
        *answer.reference_from_map,
        *(n for p in answer.pairs for n in (p.target, p.source)),
    ):
        if name not in maps.names:
            raise ValueError(f"{run / run_folder.MERGE_FILE}: names a map {name[:100]!r} that the run does not have")
    for pair in answer.pairs:
        if (pair.target, pair.source) not in truth.pairs:
            raise ValueError(f"{run / run_folder.TRUTH_FILE}: has no pair {pair.target}, {pair.source}")


def score_bytes(path: Path, score: RunScore) -> bytes:
    """Write the content of score.json."""
    pairs = [to_row(one) | {"right_thesis": one.error is not None and THESIS.holds(one.error)} for one in score.pairs]
    merged = [
        {
            "reference": one.reference,
            "maps": list(one.maps),
            **dataclasses.asdict(one.quality),
            "pose_error_m": one.pose_error_m,
        }
        for one in score.merged
    ]
    return record_bytes(path, "score", {"schema": SCHEMA, "merged": merged, "pairs": pairs, "summary": score.summary()})
