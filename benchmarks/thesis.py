"""The method of chapter 5 of the thesis in ``make bench``: cost of correcting a map, and of a pair."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from functools import partial

from rich import box
from rich.console import Console
from rich.table import Table

from mapping.geometry.scale_range import ScaleRange
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.jobs.timing import one_thread, warm_up
from merge.literature.chen2021.correction import corrected
from merge.merger import match_maps
from merge.preparation.map_image import trinary_picture
from merge.preparation.settings import PreparationSettings
from merge.settings import MergeSettings
from reproductions.chen2021.cases import SETS
from reproductions.chen2021.missions import Hall

SEED = 7
ROUNDS = 7
CORRECTION_BOUND_S, PAIR_BOUND_S = 0.3, 1.0
METHOD = "morphology"


def bench_thesis() -> None:
    """Print processor seconds on one thread, the maps being about 400 x 400 cells."""
    pair = Hall(SEED).pair(SETS[2].condition.full_coverage)
    target, source = pair.first.grid, pair.second.grid
    table = Table(
        title="chapter 5 of Chen (2021): seconds on one core", box=box.SIMPLE_HEAD, title_justify="left", pad_edge=False
    )
    table.add_column("")
    for name in ("median", "range", "bound"):
        table.add_column(name, justify="right")
    with one_thread():
        for name, grid in (("correcting a map", target), ("correcting a noisy map", source)):
            _add(table, f"{name}, {_size(grid)} cells", partial(_correct, grid), CORRECTION_BOUND_S)
        team = MapSet(("a", "b"), (target, source), ("m", "m"))
        for title, settings in _settings():
            warm_up(settings)
            _add(table, title, partial(match_maps, team, settings), PAIR_BOUND_S)
    Console(highlight=False, width=110).print(table)


def _settings() -> tuple[tuple[str, MergeSettings], ...]:
    free = ScaleRange.free()
    return (
        ("a pair as published, scale known", MergeSettings(METHOD, as_published=True)),
        ("a pair as published, scale 0.5 to 2", MergeSettings(METHOD, free, as_published=True)),
        ("a pair with the common acceptance, scale known", MergeSettings(METHOD)),
        ("a pair with the common acceptance, scale 0.5 to 2", MergeSettings(METHOD, free)),
    )


def _correct(grid: OccupancyGrid) -> None:
    corrected(trinary_picture(grid.cropped(PreparationSettings.border_cells)))


def _size(grid: OccupancyGrid) -> str:
    rows, cols = grid.frame.shape
    return f"{cols} x {rows}"


def _add(table: Table, name: str, work: Callable[[], object], bound: float) -> None:
    work()
    seconds = [_seconds(work) for _ in range(ROUNDS)]
    span = f"{min(seconds):.3f} to {max(seconds):.3f}"
    table.add_row(name, f"{statistics.median(seconds):.3f}", span, f"at most {bound:g}")


def _seconds(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


if __name__ == "__main__":
    bench_thesis()
