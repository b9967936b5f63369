"""True overlap of the maps of a case."""

from __future__ import annotations

from pathlib import Path
from statistics import median

from reproductions.chen2021.answers import compared_cells
from reproductions.chen2021.cases import CASES, PLACES
from reproductions.chen2021.make import maps_file
from reproductions.chen2021.map_store import read_maps


def true_overlaps(out: Path, seeds: int) -> dict[str, float]:
    """Take the median over seeds, by case, of the commonly known area at the truth, as a share of the smaller map."""
    found: dict[str, list[float]] = {}
    for place in PLACES:
        for seed in range(seeds):
            maps = read_maps(maps_file(out, place, seed))
            for case in (case for case in CASES if case.place == place and not case.team):
                target, source = (maps[name] for name in case.maps)
                found.setdefault(case.name, []).append(compared_cells(target, source).overlap)
    return {case: median(shares) for case, shares in found.items()}
