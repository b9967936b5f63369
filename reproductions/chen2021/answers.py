"""Answers of the methods to a pair of maps, evaluated by the criterion of the thesis."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.pixel_matrix import pixel_matrix
from mapping.map_set import MapSet
from mapquilt.evaluation.evaluated_pair import GroundTruth, PairInfo, evaluate_pair
from mapquilt.evaluation.transform_error import THESIS
from merge.pair.feature_cache import FeatureCache
from merge.pair.pipeline import match
from merge.pair.task import PairTask
from merge.preparation.map_image import FREE_GREY, OCCUPIED_GREY, UNKNOWN_GREY, trinary_picture
from merge.records.result import PairResult
from merge.verification.cell_overlap import compare_cells
from reproductions.chen2021.methods import METHODS, SCALE
from reproductions.chen2021.missions import MapPair

DARK, LIGHT = 100, 240
"""Greys of the thesis: darker is occupied, lighter is free."""


@dataclass(frozen=True)
class Answer:
    """A method's answer in one run: ``trial`` and ``seed`` name the maps, ``run`` the random numbers of the method.

    ``index`` is the acceptance index at the answer on the original rasters, ``index_of_greys`` the same as the thesis
    computes it; None without common cells, and for a team. The place is that of the second map in the first [m, rad].
    """

    trial: str
    method: str
    seed: int
    run: int
    right: bool
    accepted: bool
    rotation_deg: float | None = None
    scale_percent: float | None = None
    displacement_cells: float | None = None
    index: float | None = None
    index_of_greys: float | None = None
    x: float | None = None
    y: float | None = None
    yaw: float | None = None
    scale: float | None = None

    @property
    def place(self) -> Similarity2 | None:
        if self.x is None or self.y is None or self.yaw is None or self.scale is None:
            return None
        return Similarity2(self.x, self.y, self.yaw, self.scale)


def answers_of(pair: MapPair, trial: str, methods: Sequence[str], seed: int, cache: FeatureCache) -> Iterator[Answer]:
    """Run methods on a pair of maps, each as often as it is random."""
    for method in methods:
        for run, result in enumerate(results(pair, method, seed, cache)):
            yield evaluated(pair, trial, method, seed, run, result)


def results(pair: MapPair, method: str, seed: int, cache: FeatureCache) -> Iterator[PairResult]:
    """Yield the results of all runs of a method on a pair; many pairs have a map in common, so features are kept."""
    chosen = METHODS[method]
    maps = MapSet(pair.names, (pair.first.grid, pair.second.grid), ("m", "m"))
    for run in range(chosen.runs):
        yield match(PairTask.of(maps, 0, 1, SCALE, chosen.settings, seed * chosen.runs + run), cache)


def evaluated(pair: MapPair, trial: str, method: str, seed: int, run: int, result: PairResult) -> Answer:
    """Compare a result with the truth, and compute its acceptance indices."""
    info, truth = PairInfo(trial, *pair.names, mission=str(seed)), GroundTruth(pair.truth, residual_m=0.0)
    grids = pair.first.grid, pair.second.grid
    found = evaluate_pair(*grids, truth, result, pair=info, method=method, criterion=THESIS)
    answer = Answer(trial, method, seed, run, found.right, result.accepted)
    if found.error is not None:
        error = found.error
        answer = replace(
            answer,
            rotation_deg=error.rotation_deg,
            scale_percent=error.scale_percent,
            displacement_cells=error.displacement_cells,
        )
    place = result.target_from_source
    if place is None:
        return answer
    answer = replace(answer, x=place.x, y=place.y, yaw=place.yaw, scale=place.scale)
    return replace(answer, index=acceptance_index(pair, place), index_of_greys=acceptance_index_of_greys(pair, place))


def acceptance_index(pair: MapPair, place: Similarity2) -> float | None:
    """Compare the original rasters at a place of the second map in the first [m]."""
    corners = [
        Similarity2.from_se2(each.grid.frame.origin, each.grid.frame.resolution) for each in (pair.first, pair.second)
    ]
    cells = corners[0].inverse() @ place @ corners[1]
    return compare_cells(pair.first.grid, pair.second.grid, cells).acceptance_index


def acceptance_index_of_greys(pair: MapPair, place: Similarity2) -> float | None:
    """Compare the maps as the thesis does: the second one's three greys, resampled bilinearly in the first.

    The resampling mixes the greys at borders, and what is then neither dark nor light counts as unknown. So fewer
    cells of walls are compared, and the index is higher.
    """
    first, second = pair.first.grid, pair.second.grid
    matrix = pixel_matrix(first.frame, place, second.frame)
    here = trinary_picture(first)
    rows, cols = here.shape
    there = cv2.warpAffine(
        trinary_picture(second), matrix, (cols, rows), flags=cv2.INTER_LINEAR, borderValue=UNKNOWN_GREY
    )
    there = np.where(there < DARK, OCCUPIED_GREY, np.where(there > LIGHT, FREE_GREY, UNKNOWN_GREY))
    both = (here != UNKNOWN_GREY) & (there != UNKNOWN_GREY)
    return float((here == there)[both].mean()) if both.any() else None
