"""Remedies for refused pairs, and the fit of a map that is mirrored."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from types import MappingProxyType

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from merge.merger import match_maps
from merge.records.result import PairResult
from merge.records.verdict import Reason
from merge.settings import MergeSettings

NEAR_ONE = 0.05
"""Greatest deviation of a scale from 1 that suggests that the stated resolutions are right."""

_PRIOR = "--prior NAME:X,Y,YAW"
ADVICE: Mapping[Reason, str] = MappingProxyType(
    {
        Reason.NOTHING_PROPOSED: "check that the maps show one place",
        Reason.LITTLE_STRUCTURE: f"map more walls, or say where a map lies: {_PRIOR}",
        Reason.PARALLEL_WALLS: f"map a crossing or a room that both robots see, or say where a map lies: {_PRIOR}",
        Reason.LITTLE_OVERLAP: f"map more ground that both robots see, or say where a map lies: {_PRIOR}",
        Reason.FREE_SPACE_VIOLATION: "check that the maps show one place at one time, without drift",
        Reason.AMBIGUOUS: f"look at the two placements, and say where a map lies: {_PRIOR}",
        Reason.SYMMETRIC: f"say where a map lies: {_PRIOR}; or map what tells the two ends apart",
        Reason.IMPRECISE: "map more ground that both robots see, or accept less: --min-confidence 0.5",
        Reason.OTHER_SCALE: "--scale free, or correct `resolution` in the YAML",
        Reason.OUTSIDE_SCALES: "search other scales: --scale LO:HI",
        Reason.MIRRORED: "flip one of the two pictures left to right",
        Reason.CONTRADICTS_PRIOR: "check the pose and the yaw [rad] of --prior, or widen its SIGMA",
        Reason.CONTRADICTS_TEAM: "look for a map that is bent or of another place, and leave it out",
        Reason.NO_PREDICTED_OVERLAP: "map more ground that both robots see",
        Reason.NOT_SELECTED: "merge the two maps alone, or --set multimap.selection.partners=10",
        Reason.LOW_CONFIDENCE: "ask for less: --min-confidence",
        Reason.NO_PUBLISHED_ANSWER: "leave out --as-published, or take another --method",
        Reason.PUBLISHED_RULE: "leave out --as-published, or take another --method",
    }
)
"""What to try after a refusal, by its reason; options of the scale are added by ``remedy``."""

_BY_SCALE = frozenset(
    {
        Reason.NOTHING_PROPOSED,
        Reason.LITTLE_STRUCTURE,
        Reason.PARALLEL_WALLS,
        Reason.LITTLE_OVERLAP,
        Reason.FREE_SPACE_VIOLATION,
        Reason.AMBIGUOUS,
        Reason.IMPRECISE,
        Reason.LOW_CONFIDENCE,
    }
)
"""Reasons that another range of scales may remove."""


def remedy(pair: PairResult, maps: MapSet, settings: MergeSettings) -> str:
    """Say what to try for a refused pair: for its reason, and by ``--scale`` where that may help.

    Raises ``ValueError`` if the pair is accepted.
    """
    if pair.reason is None:
        raise ValueError(f"remedy: the pair of {pair.target} and {pair.source} is accepted")
    texts = [ADVICE[pair.reason]]
    searched = settings.scale or maps.scale_range
    if pair.reason in _BY_SCALE:
        stated = {maps.units[maps.names.index(name)] for name in (pair.target, pair.source)} == {"m"}
        scale = None if pair.target_from_source is None else pair.target_from_source.scale
        if searched.fixed:
            texts.append("if a stated resolution may be wrong, search other scales: --scale free")
        elif stated and scale is not None and abs(math.log(scale)) < NEAR_ONE:
            texts.insert(0, f"if the stated resolutions are right (the scale found is {scale:.3f}): --scale known")
        elif pair.reason is Reason.NOTHING_PROPOSED:
            texts.append("search other scales: --scale LO:HI")
    return "; or ".join(texts)


def mirrored_fit(
    pair: PairResult, maps: MapSet, settings: MergeSettings, seed: int
) -> tuple[OccupancyGrid, PairResult] | None:
    """Return the mirrored source of a pair that was refused as mirrored, and the answer to it; None for other pairs."""
    if pair.reason is not Reason.MIRRORED:
        return None
    indices = [maps.names.index(name) for name in (pair.target, pair.source)]
    target, source = (maps.grids[index] for index in indices)
    mirrored = OccupancyGrid(source.frame, source.log_odds[:, ::-1])
    two = MapSet(
        (pair.target, pair.source),
        (target, mirrored),
        (maps.units[indices[0]], maps.units[indices[1]]),
        resolutions_trusted=maps.resolutions_trusted,
    )
    (answer,) = match_maps(two, dataclasses.replace(settings, priors=(), reference=None, trust_priors=False), seed)
    return mirrored, answer
