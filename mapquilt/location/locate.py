"""Match a robot's map to each of several plans, and name at most one."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.pixel_matrix import pixel_matrix
from mapping.map_set import Unit
from mapping.validation import require_ordered, require_valid
from mapquilt.location.acceptance import PlanAcceptanceSettings, PlanVerdict, decide_on_plan
from mapquilt.location.plan_picture import PlanPicture
from mapquilt.location.wall_agreement import WallAgreement, refine_on_walls, wall_agreement
from merge.pair.feature_cache import FeatureCache
from merge.pair.pipeline import match
from merge.pair.task import PairTask
from merge.records.result import PairResult
from merge.settings import MergeSettings
from worlds.importing.drawn_walls import plan_grid


@dataclass(frozen=True)
class LocationSettings:
    """Set up the search for the plan of a map.

    - ``merge``: settings of the merger, whose least confidence is that of the plan named;
    - ``plan_resolution`` [m a pixel]: that of all plans; None if unknown;
    - ``scale``: range of metres of the plan per metre of the map, if ``plan_resolution`` is given: drawings and prints
      are some per cent off;
    - ``extent``: least and greatest diagonal of the map, as a share of the building's, if it is not given: they bound
      the scale. A map can be larger than the plan by what beams see outside;
    - ``acceptance``: how certain a place on a plan must be;
    - ``cells_per_wall``: thickness of a plan's walls in cells of its grid, as in a map of 5 cm cells.
    """

    merge: MergeSettings = field(default_factory=MergeSettings)
    plan_resolution: float | None = None
    scale: ScaleRange = ScaleRange(0.9, 1.1)
    extent: tuple[float, float] = (0.35, 1.4)
    acceptance: PlanAcceptanceSettings = field(default_factory=PlanAcceptanceSettings)
    cells_per_wall: float = 3.0

    def __post_init__(self) -> None:
        require_valid(self)
        require_ordered(self, "extent")


@dataclass(frozen=True, eq=False)
class Placement:
    """A map on one plan.

    - ``plan_from_scan``: from the map's stated metres (or cells) to the plan's ``unit``, from its lower left corner, y
      up: metres if the plan's resolution is known, else pixels. It is the merger's answer, refined on the plan's walls;
      None if nothing was proposed;
    - ``plan_from_scan_pixels`` (2, 3): the same between pixels of the pictures, y down;
    - ``covariance`` (4, 4) of x, y, yaw and scale, as those of ``PairResult``;
    - ``scan_per_pixel``: metres (or cells) of the map per pixel of the plan's picture;
    - ``confidence``: probability that this is the plan and the place right, all plans considered; ``verdict`` is
      that by this plan only, and ``answer`` the whole answer of the merger, in units of its own;
    - ``walls``: what the map says of the plan's walls;
    - ``reason`` that the plan is not named, None if it is.
    """

    plan: PlanPicture
    plan_from_scan: Similarity2 | None
    plan_from_scan_pixels: NDArray[np.float64] | None
    covariance: NDArray[np.float64] | None
    unit: str
    scan_per_pixel: float | None
    confidence: float
    answer: PairResult
    walls: WallAgreement
    verdict: PlanVerdict
    reason: str | None


def locate(
    scan: OccupancyGrid,
    plans: Sequence[PlanPicture],
    settings: LocationSettings = LocationSettings(),
    *,
    seed: int = 0,
    unit: Unit = "m",
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[Placement, ...]:
    """Match a map to each plan; return the placements, the most confident first.

    At most the first is named (its ``reason`` is None): the plans and "none of them" exclude each other, and each
    plan's odds are those of its own match. So two plans that fit alike have at most half of the confidence each.
    ``unit`` is that of the map's coordinates. Raises ``ValueError`` if a resolution is given for a map without.
    """
    if unit == "cell" and settings.plan_resolution is not None:
        raise ValueError("the map states no resolution, so that the plan's gives no scale")
    cache = FeatureCache(settings.merge.preparation, kept=2)
    found: list[Placement] = []
    for plan in plans:
        on_progress(len(found), len(plans))
        found.append(_match(scan, plan, settings, seed, unit, cache))
    odds = [one.verdict.confidence / max(1e-9, 1.0 - one.verdict.confidence) for one in found]
    shared = [
        dataclasses.replace(one, confidence=each / (1.0 + sum(odds))) for one, each in zip(found, odds, strict=True)
    ]
    ranked = sorted(shared, key=lambda one: (-one.confidence, -_score(one)))
    least = settings.merge.acceptance.min_confidence
    return tuple(dataclasses.replace(one, reason=_reason(rank, ranked, least)) for rank, one in enumerate(ranked))


def _score(placement: Placement) -> float:
    evidence = placement.answer.evidence
    return 0.0 if evidence is None else evidence.score


def _reason(rank: int, ranked: Sequence[Placement], least: float) -> str | None:
    """Return why a placement is not named, None for the first if it is certain enough."""
    one = ranked[rank]
    if one.verdict.reason is not None:
        return one.verdict.reason
    if rank == 0 and one.confidence >= least:
        return None
    other = ranked[1] if rank == 0 else ranked[0]
    return f"fits, but so does {other.plan.name}"


def _match(
    scan: OccupancyGrid, plan: PlanPicture, settings: LocationSettings, seed: int, unit: Unit, cache: FeatureCache
) -> Placement:
    """Match a map to a plan whose pixels are so wide that the middle of the range of scales is 1."""
    low, high = settings.extent
    if settings.plan_resolution is None:
        pixel = scan.known_diagonal / plan.diagonal / (low * high) ** 0.5
        half = (high / low) ** 0.5
        scale = ScaleRange(1.0 / half, half)
    else:
        pixel, scale = settings.plan_resolution, settings.scale
    grid = plan_grid(plan.walls, plan.shrunk * pixel, settings.cells_per_wall)
    task = PairTask((plan.name, "scan"), (grid, scan), ("m", "m"), scale, settings.merge, seed)
    answer = match(task, cache)
    known = settings.plan_resolution is not None
    stated = 1.0 if known else 1.0 / pixel
    place = answer.target_from_source
    if place is not None:
        refined = refine_on_walls(grid, scan, place.inverse()).inverse()
        place = refined if scale.low <= refined.scale <= scale.high else place
    pixels = scan_per_pixel = None
    walls = WallAgreement(0, 0)
    rivals: list[WallAgreement] = []
    if place is not None:
        walls, *rivals = (
            wall_agreement(grid, scan, each.inverse())
            for each in (place, *(other.target_from_source for other in answer.alternatives))
        )
    verdict = decide_on_plan(answer, walls, rivals, settings.acceptance, settings.merge.acceptance)
    if place is not None:
        scan_per_pixel = pixel / place.scale
        in_pixels = Similarity2(place.x / pixel, place.y / pixel, place.yaw, place.scale / pixel)
        picture = GridFrame(1.0, SE2.identity(), plan.grey.shape)
        pixels = frozen_array(pixel_matrix(picture, in_pixels, scan.frame), np.float64)
        place = Similarity2(stated * place.x, stated * place.y, place.yaw, stated * place.scale)
    spread = np.array([stated, stated, 1.0, stated])
    covariance = None if answer.covariance is None else answer.covariance * np.outer(spread, spread)
    return Placement(
        plan=plan,
        plan_from_scan=place,
        plan_from_scan_pixels=pixels,
        covariance=covariance,
        unit="m" if known else "pixel",
        scan_per_pixel=scan_per_pixel,
        confidence=0.0,
        answer=answer,
        walls=walls,
        verdict=verdict,
        reason=None,
    )
