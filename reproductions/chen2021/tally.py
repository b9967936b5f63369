"""Answers of the reproduction, aggregated by case and method."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median

from mapping.seeds import Role, stream
from mapquilt.evaluation.aggregation import Aggregate, aggregate
from mapquilt.evaluation.statistics import Share
from reproductions.chen2021.answers import compared_cells
from reproductions.chen2021.cases import CASES, PLACES, Case
from reproductions.chen2021.make import Study, maps_file
from reproductions.chen2021.map_store import read_maps


@dataclass(frozen=True)
class CaseTally:
    """One case and method; None if there is nothing to count.

    ``overlap``: median true overlap of the two maps, as a share of the smaller; ``found``: shares and errors; ``index``
    and ``true_index``: median acceptance index at the answers and at the truth; ``seconds``: median.
    """

    case: Case
    method: str
    overlap: float | None
    found: Aggregate
    index: float | None
    true_index: float | None
    seconds: float

    @property
    def right(self) -> Share:
        return _counted(self.found.right)

    @property
    def true_accepts(self) -> Share:
        return _counted(self.found.true_accepts)

    @property
    def false_accepts(self) -> int:
        return _counted(self.found.false_accepts).count

    def median_error(self, name: str) -> float | None:
        """Return the median of an error of ``TransformError`` over right answers."""
        errors = self.found.errors_right[name]
        return None if errors is None else errors.median


def _counted(share: Share | None) -> Share:
    if share is None:
        raise ValueError("a case has no answers")
    return share


def tallies(study: Study, overlaps: Mapping[str, float]) -> list[CaseTally]:
    """Aggregate each case and method, by case; ``overlaps`` by case."""
    return [_tally(study, case, method, overlaps.get(case.name)) for case in CASES for method in study.spec.methods]


def _tally(study: Study, case: Case, method: str, overlap: float | None) -> CaseTally:
    timed = zip(study.answers, study.seconds, strict=True)
    chosen = [(one, seconds) for one, seconds in timed if (one.case, one.pair.method) == (case.name, method)]
    pairs = [one.pair for one, _ in chosen]
    return CaseTally(
        case=case,
        method=method,
        overlap=overlap,
        found=aggregate(pairs, pairs, partial(stream, 0, Role.BENCHMARK_BOOTSTRAP)),
        index=_median([one.index for one, _ in chosen]),
        true_index=_median([one.true_index for one, _ in chosen]),
        seconds=median(seconds for _, seconds in chosen),
    )


def _median(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return median(known) if known else None


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
