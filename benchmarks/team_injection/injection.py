"""Answers for the pairs of a drawn team: right ones with the noise of real answers, and wrong ones put among them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from benchmarks.team_injection.drawn_team import DrawnTeam
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from merge.pair.feature_cache import metres_from_prepared, prepare_map
from merge.preparation.prepared_map import PreparedMap
from merge.records.result import PairResult
from merge.verification.wall_overlap import measure_wall_overlap

Pair = tuple[int, int]

LEAST_OVERLAP = 0.2
"""Pairs that share less of the smaller map get no answer."""

ANSWERED = 0.85
"""This fraction of the pairs that overlap enough get an answer."""

SIGMA_SHARE, YAW_SIGMA, LOG_SCALE_SIGMA = 0.003, math.radians(0.25), 0.003
"""Standard deviations of right answers, like those of the merger: share of the smaller diagonal, yaw, log scale."""

WRONG_BEYOND = 0.1
"""A wrong answer moves the source's middle by at least this share of its diagonal, or rotates it by a quarter turn."""


POINTS = 400


@dataclass(frozen=True, eq=False)
class Injected:
    """The answers of a team, and the pairs whose answers are ``wrong``."""

    pairs: tuple[PairResult, ...]
    wrong: frozenset[tuple[str, str]]


def inject(team: DrawnTeam, share: float, rng: np.random.Generator, draws: int = 1) -> Injected | None:
    """Draw the answers of a team, of which a ``share`` is wrong, with the same confidence as the right ones.

    All maps stay connected without any one of the right answers, so no map need be lost. Returns None if the maps
    overlap too little for that. Each wrong answer is the one of several ``draws`` with the best wall overlap.
    """
    overlaps = {pair: _overlap(team, *pair) for pair in combinations(range(len(team.maps)), 2)}
    right = [p for p, share in overlaps.items() if share >= LEAST_OVERLAP and rng.random() < ANSWERED]
    number = len(team.maps)
    if not _stays_connected(number, right):
        return None
    wrong: list[Pair] = []
    spare = [pair for pair in overlaps if pair not in right]
    rng.shuffle(spare)
    while len(wrong) < round(share * (len(right) + len(wrong))):
        taken = spare.pop() if spare and rng.random() < 0.5 else _redundant(number, right, rng)
        if taken is None and not spare:
            break
        taken = taken if taken is not None else spare.pop()
        right = [pair for pair in right if pair != taken]
        wrong.append(taken)
    charts = [prepare_map(grid) for grid in team.maps.grids]
    answers = [
        _answer(team, (a, b), (charts[a], charts[b]), draws if (a, b) in wrong else 0, rng)
        for a, b in sorted([*right, *wrong])
    ]
    names = team.maps.names
    return Injected(tuple(answers), frozenset((names[a], names[b]) for a, b in wrong))


def _overlap(team: DrawnTeam, target: int, source: int) -> float:
    there, here = team.maps.grids[target], team.maps.grids[source]
    points = here.frame.metres_from_cells(np.argwhere(here.known))
    cells = there.frame.cells_from_metres(team.truth(target, source).apply(points))
    inside = there.frame.contains(cells)
    common = np.count_nonzero(there.known[cells[inside, 0], cells[inside, 1]]) / len(points)
    scale = team.truth(target, source).scale * here.frame.resolution / there.frame.resolution
    smaller = min(1.0, np.count_nonzero(there.known) / (len(points) * scale**2))
    return float(common / smaller)


def _stays_connected(number: int, pairs: list[Pair]) -> bool:
    """Check if the pairs join all maps, even without any one of them; three maps need only be joined.

    With only two answers about a map, nothing shows which one is right.
    """
    if number < 4:
        return _is_connected(number, pairs)
    return all(_is_connected(number, [*pairs[:k], *pairs[k + 1 :]]) for k in range(len(pairs)))


def _is_connected(number: int, pairs: list[Pair]) -> bool:
    rows, cols = [a for a, _ in pairs], [b for _, b in pairs]
    graph = csr_array((np.ones(len(rows)), (rows, cols)), shape=(number, number))
    return int(connected_components(graph, directed=False)[0]) == 1


def _redundant(number: int, right: list[Pair], rng: np.random.Generator) -> Pair | None:
    """Return a right pair without which the others still join all maps."""
    for k in map(int, rng.permutation(len(right))):
        if _stays_connected(number, [pair for pair in right if pair != right[k]]):
            return right[k]
    return None


def _answer(
    team: DrawnTeam, pair: Pair, charts: tuple[PreparedMap, PreparedMap], draws: int, rng: np.random.Generator
) -> PairResult:
    target, source = pair
    there, here = team.maps.grids[target], team.maps.grids[source]
    truth = team.truth(target, source)
    size = min(there.known_diagonal, truth.scale * here.known_diagonal)
    middle = truth.apply(here.frame.metres_from_cells(np.argwhere(here.known)).mean(axis=0))
    fixed = team.maps.resolutions_trusted
    sigma = np.array([SIGMA_SHARE * size, SIGMA_SHARE * size, YAW_SIGMA, 0.0 if fixed else LOG_SCALE_SIGMA])
    if draws:
        poses = [_moved(truth, middle, _wrong(size, fixed, rng)) for _ in range(draws)]
        found = max(poses, key=lambda pose: _wall_score(there.frame, here.frame, charts, pose))
    else:
        found = _moved(truth, middle, sigma * rng.standard_normal(4))
    moved = np.diag([1.0, 1.0, 1.0, found.scale]) @ Similarity2(*(middle - (found.x, found.y))).adjoint()
    return PairResult(
        target=team.maps.names[target],
        source=team.maps.names[source],
        accepted=True,
        confidence=float(rng.uniform(0.7, 1.0)),
        refusal=None,
        target_from_source=found,
        target_from_source_pixels=None,
        unit="m",
        evidence=None,
        covariance=moved @ np.diag(sigma**2) @ moved.T,
    )


def _moved(truth: Similarity2, middle: NDArray[np.float64], move: NDArray[np.float64]) -> Similarity2:
    return Similarity2(move[0], move[1], move[2], math.exp(move[3])).about(middle) @ truth


def _wall_score(
    there: GridFrame, here: GridFrame, charts: tuple[PreparedMap, PreparedMap], place: Similarity2
) -> float:
    cells = metres_from_prepared(there, charts[0]).inverse() @ place @ metres_from_prepared(here, charts[1])
    return measure_wall_overlap(*charts, cells, POINTS).score


def _wrong(size: float, fixed: bool, rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw a wrong move: to the next room, by half a turn, or anywhere."""
    turns = rng.choice([0.0, math.pi / 2.0, math.pi, -math.pi / 2.0]) if rng.random() < 0.7 else rng.uniform(-3.1, 3.1)
    reach, way = size * rng.uniform(WRONG_BEYOND, 0.6), rng.uniform(-math.pi, math.pi)
    growth = 0.0 if fixed or rng.random() < 0.5 else rng.uniform(-0.3, 0.3)
    return np.array([reach * math.cos(way), reach * math.sin(way), turns, growth])
