"""What the command line says of scales: how wrong maps state theirs, and how wide the merger searches."""

from __future__ import annotations

import math

from mapping.geometry.scale_range import ScaleRange
from mapping.grid.frame_perturbation import FramePerturbationRanges
from mapquilt.numbers import parse_range

_DISGUISES = {"hidden": (0.5, 2.0), "honest": (1.0, 1.0)}
_SEARCHES: dict[str, ScaleRange | None] = {"auto": None, "known": ScaleRange.known(), "free": ScaleRange.free()}

WIDEST = 20.0
"""Scales are searched from its inverse up to it."""


def disguise_ranges(scale: str, max_rotation_deg: float, max_offset: float) -> FramePerturbationRanges:
    """What disguises are drawn from; ``scale`` is hidden (0.5 to 2), honest (1) or LO:HI.

    Raises ``ValueError`` naming the setting and the value.
    """
    try:
        bounds = _DISGUISES[scale] if scale in _DISGUISES else parse_range(scale)
    except ValueError:
        raise ValueError(f"scale is {scale}, must be hidden, honest or LO:HI such as 0.8:1.25") from None
    if not 0.0 <= max_rotation_deg <= 180.0:
        raise ValueError(f"max_rotation is {max_rotation_deg:g}, must lie between 0 and 180 degrees")
    return FramePerturbationRanges(*bounds, math.radians(max_rotation_deg), max_offset)


def searched_scales(scale: str) -> ScaleRange | None:
    """The scales that an answer may have: known, free (0.5 to 2), LO:HI, or auto, which is left to the maps: None.

    Raises ``ValueError`` naming the value.
    """
    if scale in _SEARCHES:
        return _SEARCHES[scale]
    try:
        low, high = parse_range(scale)
    except ValueError:
        raise ValueError(f"scale is {scale}, must be auto, known, free or LO:HI such as 0.5:2") from None
    if not 1.0 / WIDEST <= low <= high <= WIDEST:
        raise ValueError(f"scale is {scale}, must be LO:HI with {1.0 / WIDEST:g} <= LO <= HI <= {WIDEST:g}")
    return ScaleRange(low, high)
