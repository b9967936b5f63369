"""Grids re-expressed in frames of their own: rotated, shifted, and with cells of another true size than stated."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import MAX_PICTURE_CELLS, GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import resampled
from mapping.seeds import Role, stream

LARGEST_SCALE = 10.0
"""A stated resolution that is wrong by more than this factor is a wrong unit."""

LARGEST_OFFSET = 1e7
"""The largest offset of an origin [m], as in the metres of a national grid."""


@dataclass(frozen=True)
class FramePerturbationRanges:
    """Ranges from which the frame perturbation ("disguise") of each map is drawn.

    Rotation and offset are uniform. The logarithm of the scale is the sum of two uniform numbers, one of the team and
    one of the map, so scales in the middle are likelier than those at the ends. ``scale_low`` and ``scale_high`` are
    true metres per stated metre; ``max_yaw`` [rad] bounds the rotation either way, ``max_offset`` the shift of either
    coordinate [stated metres].

    Raises ``ValueError`` naming the field and the value.
    """

    scale_low: float = 0.5
    scale_high: float = 2.0
    max_yaw: float = math.pi
    max_offset: float = 10.0

    def __post_init__(self) -> None:
        if not 1.0 / LARGEST_SCALE <= self.scale_low <= self.scale_high <= LARGEST_SCALE:
            scale = f"{self.scale_low:g}:{self.scale_high:g}"
            bounds = f"{1.0 / LARGEST_SCALE:g} <= LO <= HI <= {LARGEST_SCALE:g}"
            raise ValueError(f"FramePerturbationRanges: scale is {scale}, must be LO:HI with {bounds}")
        if not 0.0 <= self.max_yaw <= math.pi:
            raise ValueError(f"FramePerturbationRanges: max_yaw is {self.max_yaw}, must lie between 0 and pi")
        if not 0.0 <= self.max_offset <= LARGEST_OFFSET:
            raise ValueError(
                f"FramePerturbationRanges: max_offset is {self.max_offset}, must lie between 0 and {LARGEST_OFFSET:g} m"
            )

    @property
    def honest(self) -> bool:
        """True if every map states its true resolution."""
        return self.scale_low == self.scale_high == 1.0


def draw_frame_perturbations(seed: int, maps: int, ranges: FramePerturbationRanges) -> tuple[Similarity2, ...]:
    """Draw ``start_from_map`` of each map of a team, from metres as the map states them to the robot's start frame.

    In logarithms, the team shares a scale, uniform in the middle half of the range, and each map adds its own, uniform
    in half the range's width around 0. So a map's scale is the sum of two uniform draws and not log-uniform itself.
    The ratio of two maps' scales is independent of the team's and stays within sqrt(low / high) and sqrt(high / low):
    0.5 to 2 by default. Each map has its own stream and four draws whatever the ranges, so narrowing one range leaves
    the other draws unchanged.
    """
    centre = math.log(ranges.scale_low * ranges.scale_high) / 2.0
    width = math.log(ranges.scale_high / ranges.scale_low)
    team = centre + width / 2.0 * (stream(seed, Role.TEAM_SCALE).random() - 0.5)
    return tuple(_draw(stream(seed, Role.DISGUISE, index), team, width / 2.0, ranges) for index in range(maps))


def _draw(rng: np.random.Generator, team: float, width: float, ranges: FramePerturbationRanges) -> Similarity2:
    along, turn, right, up = rng.random(4)
    scale = math.exp(team + width * (along - 0.5))
    yaw = ranges.max_yaw * (2.0 * turn - 1.0)
    x, y = ranges.max_offset * (2.0 * right - 1.0), ranges.max_offset * (2.0 * up - 1.0)
    return Similarity2(x, y, yaw, 1.0 / scale).inverse()


def perturb_frame(grid: OccupancyGrid, start_from_map: Similarity2) -> OccupancyGrid:
    """Re-express a grid in the frame on the right of ``start_from_map``, with origin yaw 0 and the stated resolution.

    The true size of a new cell is ``start_from_map.scale`` times the resolution. ``resampled`` gives its log-odds.

    Raises ``ValueError`` if the grid has no known cell, or the result has more cells than a picture may have.
    """
    if not grid.known.any():
        raise ValueError("frame perturbation: the grid has no known cell")
    frame = _bounding_frame(grid.frame, start_from_map)
    rows, cols = frame.shape
    if rows * cols > MAX_PICTURE_CELLS:
        raise ValueError(
            f"frame perturbation: a map of {rows} x {cols} cells is too large to be read again, use coarser cells"
        )
    perturbed = OccupancyGrid(frame, resampled(grid, start_from_map.inverse(), frame))
    if not perturbed.known.any():
        raise ValueError("frame perturbation: no known cell is left at this scale")
    return perturbed.cropped()


def _bounding_frame(old: GridFrame, start_from_map: Similarity2) -> GridFrame:
    rows, cols = old.shape
    corners = old.metres_from_cells(np.array([[0, 0], [rows, 0], [0, cols], [rows, cols]]) - 0.5)
    corners = start_from_map.inverse().apply(corners)
    low, high = corners.min(axis=0), corners.max(axis=0)
    new_cols, new_rows = (int(n) for n in np.ceil((high - low) / old.resolution - 1e-9))
    return GridFrame(old.resolution, SE2(low[0], low[1], 0.0), (max(new_rows, 1), max(new_cols, 1)))
