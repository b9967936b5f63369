"""Growth of a merge with the number of maps of one large building.

``python -m benchmarks.team_scale --maps 20,50,100,200,500 --out scale`` writes scale.csv, one row for each team, and
scale.png, and prints the table. Time and memory are those of the merge and its workers, not of drawing the maps.
"""

from __future__ import annotations

import argparse
import csv
import math
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, fields
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.table import Table
from scipy.sparse import csr_array

from benchmarks.team_injection.drawn_team import DrawnSettings, DrawnTeam, draw_team
from benchmarks.team_injection.usage import usage
from mapping.grid.occupancy_grid import OccupancyGrid
from mapquilt.cli.options.merge import pair_workers
from mapquilt.cli.tables import print_table
from mapquilt.jobs.progress import count_progress
from mapquilt.jobs.runner import remote_runner
from mapquilt.viz.plot_style import GRID, MUTED, logarithmic, new_figure, series_colour, write_axes, write_heading
from mapquilt.viz.png import figure_png
from mapquilt.viz.text_table import plain_table
from merge.merger import merge_maps
from merge.multimap.place_index import DescribeTask, describe
from merge.records.result import MergeResult, PairResult
from merge.retrieval.similar_places import suggest_poses
from merge.settings import MergeSettings
from worlds.families.registry import FAMILIES, make_world

SEED = 5

NEIGHBOURS = 5
"""Best maps of the index that are looked at."""

OVERLAP = 0.3
"""Least share of the smaller map that a neighbour shares."""

OVERLAP_CELL = 0.2
"""Cells in which overlap is counted [m]."""

WRONG = 1.0
"""Mean displacement of a map from which on a join is wrong [m]."""


@dataclass(frozen=True)
class Row:
    """One team: pairs matched and accepted, share of maps in the largest group, accepted pairs in a wrong place, share
    of maps with a true neighbour among the first five of the index, processor and wall time [s], peak memory [MB]."""

    maps: int
    matched: int
    accepted: int
    joined: float
    wrong: int
    recall: float
    index_s: float
    cpu_s: float
    wall_s: float
    memory_mb: float


def draw_building(maps: int, family: str = "office", world_seed: int = 3) -> DrawnTeam:
    """Draw maps of about 20 x 20 m of one building, whose area grows with their number."""
    side = max(40.0, 9.0 * maps**0.5)
    settings = DrawnSettings(maps=maps, reach=7.0, range=6.5)
    return draw_team(make_world(family, world_seed, side, 0.7 * side), settings, np.random.default_rng(SEED))


def measure(maps: int, workers: int, family: str, world_seed: int) -> Row:
    """Draw a team and merge it, each in a process of its own, so that drawing takes no memory of the merge."""
    spawn = get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=spawn) as elsewhere:
        team = elsewhere.submit(draw_building, maps, family, world_seed).result()
    with ProcessPoolExecutor(1, mp_context=spawn) as elsewhere:
        return elsewhere.submit(measure_team, team, workers).result()


def measure_team(team: DrawnTeam, workers: int) -> Row:
    """Merge a team and compare the result with the truth."""
    maps = len(team.maps)
    start = time.perf_counter()
    with (
        usage() as used,
        remote_runner(pair_workers(maps, workers, None)) as runner,
        count_progress(f"{maps} maps, pairs") as on_progress,
    ):
        result = merge_maps(team.maps, on_progress=on_progress, runner=runner)
        wall = time.perf_counter() - start
    began = time.process_time()
    scores = index_scores(team.maps.grids)
    return Row(
        maps=maps,
        matched=sum(pair.target_from_source is not None for pair in result.pairs),
        accepted=sum(pair.accepted for pair in result.pairs),
        joined=len(result.reference_from_map) / maps,
        wrong=len(wrong_joins(team, result)),
        recall=recall(scores, overlaps(team)),
        index_s=time.process_time() - began,
        cpu_s=used.seconds,
        wall_s=wall,
        memory_mb=used.whole,
    )


def index_scores(grids: Sequence[OccupancyGrid]) -> NDArray[np.float64]:
    """Score all pairs by the index, also of a team so small that a merge does without: (N, N)."""
    settings = MergeSettings()
    patches = [describe(DescribeTask(grid, settings)) for grid in grids]
    return np.asarray(suggest_poses(patches, settings.multimap.retrieval).best_scores(len(grids)).toarray())


def wrong_joins(team: DrawnTeam, result: MergeResult) -> list[PairResult]:
    """List the accepted pairs whose source lies more than a metre off, in the mean over its known cells."""
    index = {name: k for k, name in enumerate(team.maps.names)}

    def off(pair: PairResult) -> float:
        if pair.target_from_source is None:
            return math.inf
        target, source = index[pair.target], index[pair.source]
        grid = team.maps.grids[source]
        points = grid.frame.metres_from_cells(np.argwhere(grid.known)[::50])
        moved = pair.target_from_source.apply(points) - team.truth(target, source).apply(points)
        return float(np.hypot(*moved.T).mean())

    return [pair for pair in result.pairs if pair.accepted and off(pair) > WRONG]


def overlaps(team: DrawnTeam) -> NDArray[np.float64]:
    """Return the share of the smaller map that each two maps share in truth: (N, N), 0 on the diagonal."""
    places = []
    for grid, world_from_map in zip(team.maps.grids, team.world_from_map, strict=True):
        cells = np.floor(world_from_map.apply(grid.frame.metres_from_cells(np.argwhere(grid.known))) / OVERLAP_CELL)
        places.append(np.unique(cells, axis=0))
    _, column = np.unique(np.concatenate(places), axis=0, return_inverse=True)
    row = np.repeat(np.arange(len(places)), [len(each) for each in places])
    seen = csr_array((np.ones(len(row)), (row, column.ravel())))
    common = (seen @ seen.T).toarray()
    area = common.diagonal()
    shares = common / np.minimum(area[:, None], area)
    np.fill_diagonal(shares, 0.0)
    return np.asarray(shares)


def recall(scores: NDArray[np.float64], overlap: NDArray[np.float64]) -> float:
    """Return the share of maps with a true neighbour among their best, of the maps that have one."""
    best = np.argsort(-scores, axis=1, kind="stable")[:, :NEIGHBOURS]
    found = np.take_along_axis(overlap, best, axis=1).max(axis=1) >= OVERLAP
    return float(np.mean(found[overlap.max(axis=1) >= OVERLAP]))


def table(measured: Sequence[Row]) -> Table:
    """Return the rows as a table."""
    columns = ("maps", "matched", "joined", "wrong", f"recall at {NEIGHBOURS}", "processor s", "s a map", "memory MB")
    shown = plain_table(*((name, True) for name in columns))
    for row in measured:
        shown.add_row(
            str(row.maps),
            str(row.matched),
            f"{100 * row.joined:.1f} %",
            str(row.wrong),
            f"{row.recall:.3f}",
            f"{row.cpu_s:.0f}",
            f"{row.cpu_s / row.maps:.2f}",
            f"{row.memory_mb:.0f}",
        )
    return shown


def picture(measured: Sequence[Row]) -> Figure:
    """Draw time, memory, shares and wrong joins against the number of maps, beside growth in proportion."""
    figure, (seconds, memory, shares, wrong) = new_figure(2, 2)
    maps = [row.maps for row in measured]
    for panel, heading, values in (
        (seconds, "Processor time [s]", [row.cpu_s for row in measured]),
        (memory, "Peak memory [MB]", [row.memory_mb for row in measured]),
    ):
        _line(panel, maps, values, 0, "measured")
        linear = [values[-1] * number / maps[-1] for number in maps]
        panel.plot(maps, linear, color=MUTED, linestyle=":", linewidth=1.4, label="proportional to the maps")
        logarithmic(panel, "y", (1.0, 2.0, 5.0))
        write_heading(panel, heading)
    _line(shares, maps, [100.0 * row.joined for row in measured], 0, "maps joined")
    _line(shares, maps, [100.0 * row.recall for row in measured], 1, f"recall at {NEIGHBOURS}")
    shares.set_ylim(min(80.0, *(100.0 * min(row.joined, row.recall) - 5.0 for row in measured)), 100.5)
    write_heading(shares, "Share of maps [%]")
    _line(wrong, maps, [row.wrong for row in measured], 0, "wrong joins")
    wrong.set_ylim(-0.1, max(1.0, *(row.wrong for row in measured)) + 0.1)
    write_heading(wrong, "Accepted pairs in a wrong place")
    for panel in (seconds, memory, shares, wrong):
        logarithmic(panel, "x")
        panel.set_xticks(maps, [str(number) for number in maps])
        panel.grid(axis="x", color=GRID, linewidth=0.8)
        write_axes(panel, "maps", "")
        panel.legend(frameon=False, fontsize=9)
    return figure


def _line(panel: Axes, maps: Sequence[int], values: Sequence[float], series: int, label: str) -> None:
    style = ("o-", "s--")[series]
    panel.plot(maps, values, style, color=series_colour(series), linewidth=1.8, markersize=5.0, label=label)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--maps", default="20,50,100,200,500", help="numbers of maps (default: %(default)s)")
    parser.add_argument(
        "--family", default="office", choices=FAMILIES, help="family of the building (default: %(default)s)"
    )
    parser.add_argument("--world-seed", type=int, default=3, help="seed of the building (default: %(default)s)")
    parser.add_argument("--workers", type=int, default=2, help="processes that match pairs (default: %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("scale"), help="folder of the results (default: %(default)s)")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    measured = []
    with (given.out / "scale.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [each.name for each in fields(Row)])
        writer.writeheader()
        team = partial(measure, workers=given.workers, family=given.family, world_seed=given.world_seed)
        for row in map(team, map(int, given.maps.split(","))):
            writer.writerow(asdict(row))
            file.flush()
            measured.append(row)
    (given.out / "scale.png").write_bytes(figure_png(picture(measured)))
    print_table(table(measured))


if __name__ == "__main__":
    main()
