"""Benchmark the merge of teams: ``python -m benchmarks.teams [PART [NUMBER ...]]``.

``wrong [TEAMS [FIRST [DRAWS]]]``: rejection of injected wrong answers; ``averaging [TEAMS [FIRST [DRAWS]]]``: the same
by robust motion averaging (Jiang et al. 2019); ``poses [TEAMS [FIRST]]``: joint refinement compared with chained pairs;
``fusion [TEAMS [FIRST]]``: walls of the fused maps by each rule; ``speed [MAPS [WORKERS]]``: time and memory of a team
of maps of 400 x 400 cells. Without a part: all.
"""

from __future__ import annotations

import os
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import count, islice
from multiprocessing import get_context
from typing import TypeVar

import numpy as np

from benchmarks.team_injection.drawn_team import DrawnTeam
from benchmarks.team_injection.fused_walls import FusionTrial, fusion_trial
from benchmarks.team_injection.trials import (
    InjectionTrial,
    Kept,
    PoseTrial,
    averaged,
    clustered,
    injection_trial,
    pose_trial,
)
from benchmarks.team_injection.usage import usage
from benchmarks.team_scale import draw_building
from mapquilt.cli.options.merge import PRELOADED, pair_workers
from mapquilt.cli.tables import print_table
from mapquilt.evaluation.statistics import Share, ratio_of_medians_over_clusters
from mapquilt.jobs.progress import count_progress
from mapquilt.jobs.runner import process_pool, remote_runner
from mapquilt.viz.text_table import plain_table
from merge.fusion import FUSIONS
from merge.merger import merge_maps
from merge.records.result import PairResult

SHARE = 0.3

Trial = TypeVar("Trial")


def main(arguments: list[str]) -> None:
    """Run the named part with its numbers, or all parts."""
    parts: dict[str, Callable[..., None]] = {
        "wrong": bench_wrong,
        "averaging": partial(bench_wrong, keep=averaged),
        "poses": bench_poses,
        "fusion": bench_fusion,
        "speed": bench_speed,
    }
    if arguments:
        parts[arguments[0]](*map(int, arguments[1:]))
        return
    for part in parts.values():
        part()


def bench_wrong(
    teams: int = 200,
    first: int = 0,
    draws: int = 1,
    keep: Callable[[DrawnTeam, Sequence[PairResult]], Kept] = clustered,
) -> None:
    """Count the teams of 3 to 20 maps, 30 % of whose answers are wrong, that keep no wrong answer and all maps."""
    table = plain_table(
        ("team", True), ("world", False), ("maps", True), ("answers", True), ("wrong", True), ("kept", True),
        ("maps lost", True), ("right rejected", True),
    )  # fmt: skip
    trials: list[InjectionTrial] = []
    with count_progress("teams") as on_progress:
        for seed, trial in _first(teams, first, partial(injection_trial, share=SHARE, draws=draws, keep=keep)):
            trials.append(trial)
            if not trial.passed:
                row = (seed, trial.world, trial.maps, trial.edges, trial.wrong, trial.wrong_kept, trial.maps_lost)
                table.add_row(*map(str, (*row, trial.right_rejected)))
            on_progress(len(trials), teams)
    rejected, answers = sum(t.right_rejected for t in trials), sum(t.edges - t.wrong for t in trials)
    share = Share.counted([trial.passed for trial in trials])
    low, high = share.interval.low, share.interval.high
    table.caption = (
        f"{share.count} of {share.of} teams without a wrong answer and with every map "
        f"({low:.3f} to {high:.3f}); asked 0.98\n"
        f"{rejected} of {answers} right answers rejected; the table lists the teams that failed"
    )
    print_table(table)


def bench_poses(teams: int = 24, first: int = 0) -> None:
    """Compare the median pose error of joint refinement and of chained pairs, on teams of 8 maps."""
    trials: list[PoseTrial] = []
    with count_progress("teams") as on_progress:
        for _, trial in _first(teams, first, pose_trial):
            trials.append(trial)
            on_progress(len(trials), teams)
    table = plain_table(("poses", False), ("maps", True), ("median error, cells", True), ("90 %, cells", True))
    joint, chain = [trial.joint for trial in trials], [trial.chained for trial in trials]
    for name, of_teams in (("chained pairs", chain), ("refined together", joint)):
        errors = np.concatenate(of_teams)
        table.add_row(name, str(len(errors)), f"{np.median(errors):.3f}", f"{np.quantile(errors, 0.9):.3f}")
    ratio, interval = ratio_of_medians_over_clusters(joint, chain, np.random.default_rng(0))
    low, high = 100 * (1 - interval.high), 100 * (1 - interval.low)
    better = sum(np.median(trial.joint) < np.median(trial.chained) for trial in trials)
    table.caption = (
        f"the median is lower by {100 * (1 - ratio):.0f} % ({low:.0f} to {high:.0f}, teams resampled); asked 30 %\n"
        f"lower in {better} of {len(trials)} teams"
    )
    print_table(table)


def bench_fusion(teams: int = 24, first: int = 0) -> None:
    """Compare the rules of fusion on trinary maps of 2 to 6 robots, placed by their best fit."""
    trials: list[FusionTrial] = []
    with count_progress("teams") as on_progress:
        for _, trial in _first(teams, first, fusion_trial):
            trials.append(trial)
            on_progress(len(trials), teams)
    table = plain_table(
        ("fusion", False), ("lost walls", True), ("in the worst team", True), ("walls F1", True), ("free IoU", True)
    )
    for rule in FUSIONS:
        lost, f1, iou = np.array([trial[rule] for trial in trials]).T
        table.add_row(
            rule, f"{100 * lost.mean():.2f} %", f"{100 * lost.max():.2f} %", f"{f1.mean():.3f}", f"{iou.mean():.3f}"
        )
    table.caption = "lost: walls that two maps show within 0.3 m, and the fused map within 0.1 m of neither"
    print_table(table)


def _first(number: int, first: int, trial: Callable[[int], Trial | None]) -> Iterator[tuple[int, Trial]]:
    """Yield the first trials that are not None, with their seeds, in order."""
    workers = os.cpu_count() or 1
    seeds, found = count(first), 0
    with process_pool(workers, PRELOADED) as pool:
        running = deque((seed, pool.submit(trial, seed)) for seed in islice(seeds, 2 * workers))
        while found < number:
            seed, future = running.popleft()
            result, following = future.result(), next(seeds)
            running.append((following, pool.submit(trial, following)))
            if result is not None:
                found += 1
                yield seed, result
        pool.shutdown(cancel_futures=True)


def bench_speed(maps: int = 20, workers: int = 2) -> None:
    """Measure a team of maps of about 400 x 400 cells with known scale."""
    began = time.perf_counter()
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as elsewhere:  # so that its imports do not count here
        team = elsewhere.submit(draw_building, maps).result().maps
    drawing = time.perf_counter() - began
    shapes = np.array([grid.cropped().frame.shape for grid in team.grids])
    start = time.perf_counter()
    with (
        usage() as used,
        remote_runner(pair_workers(maps, workers, None)) as runner,
        count_progress("merging pairs") as on_progress,
    ):
        result = merge_maps(team, on_progress=on_progress, runner=runner)
        seconds = time.perf_counter() - start
    table = plain_table(("", False), ("measured", True), ("asked", True))
    table.add_row("maps", f"{maps} of about {int(np.median(shapes[:, 0]))} x {int(np.median(shapes[:, 1]))}", "")
    table.add_row("pairs matched", str(sum(p.target_from_source is not None for p in result.pairs)), "")
    table.add_row("joined", f"{len(result.reference_from_map)} of {maps}", "")
    table.add_row("time, without that to draw them", f"{seconds:.1f} s on {workers} workers", "40 s for 20")
    table.add_row("time to draw them", f"{drawing:.1f} s", "")
    table.add_row("processor time in all", f"{used.seconds:.1f} s", "")
    table.add_row("memory in all, shared pages once", f"{used.whole:.0f} MB", "1000 MB for 20")
    table.add_row("memory here, largest worker", f"{used.own:.0f}, {used.largest_worker:.0f} MB", "")
    print_table(table)


if __name__ == "__main__":
    main(sys.argv[1:])
