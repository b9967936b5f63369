"""Draw a world as an architect draws a floor plan."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.grid.frame import GridFrame
from mapping.seeds import Role, stream
from worlds.drafting.annotation import annotate
from worlds.drafting.sheet import Sheet, turned
from worlds.drafting.structure import DoorGap, Structure, find_structure
from worlds.drafting.style import DraftingStyle, draw_style
from worlds.polygon import Polygon
from worlds.world import World

MARGIN = 3.5
"""Blank paper around a building [m], for dimensions and titles."""
RING = 0.2
"""Thickness of the walls around a block [m]."""


@dataclass(frozen=True, eq=False)
class DraftedPlan:
    """Hold a plan as a ``grey`` picture (H, W), top row first, and its ``frame``: the exact pose of the picture in the
    world, so that ``frame.metre_from_pixel()`` takes pixels to the world [m]."""

    grey: NDArray[np.uint8]
    frame: GridFrame


def draft_plan(world: World, style: str, seed: int) -> DraftedPlan:
    """Draw a world in a style (``STYLES``), whose details ``seed`` draws.

    Walls are where they are in the world; furniture need not be. Raises ``ValueError`` if the style is unknown.
    """
    rng = stream(seed, Role.DRAFTING)
    details = draw_style(style, rng)
    structure = find_structure(world)
    sheet = Sheet(world.size, MARGIN, details.pixels_per_metre, details.paper)
    solid = _solid(sheet, world, structure, details)
    for piece in structure.furniture:
        if rng.random() < details.furniture:
            sheet.line(piece + rng.normal(0.0, details.moved, 2), details.ink, details.thin, closed=True)
    annotate(sheet, solid, world, details, rng)
    _draw_walls(sheet, solid, details)
    _draw_windows(sheet, world, details, rng)
    for door in structure.doors:
        _draw_door(sheet, door, details, rng)
    grey, frame = turned(sheet.grey, sheet.frame, details.turn, details.paper)
    return DraftedPlan(_scanned(grey, details, rng), frame)


def _solid(sheet: Sheet, world: World, structure: Structure, style: DraftingStyle) -> NDArray[np.bool_]:
    """Return the pixels of walls: those of the world, of the rings around blocks, and thicker outer walls."""
    blocks = sheet.mask(structure.blocks)
    ring = 2 * round(RING * style.pixels_per_metre) + 1
    inside = cv2.erode(blocks.astype(np.uint8), np.ones((ring, ring), np.uint8)) > 0
    solid = sheet.mask(structure.walls) | (blocks & ~inside)
    if style.outer > 0.0:
        width, height = world.size
        thick = style.outer
        grown = sheet.mask([_rectangle(-thick, -thick, width + thick, height + thick)])
        solid |= grown & ~sheet.mask([_rectangle(0.0, 0.0, width, height)])
    return solid


def _rectangle(x0: float, y0: float, x1: float, y1: float) -> Polygon:
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def _draw_walls(sheet: Sheet, solid: NDArray[np.bool_], style: DraftingStyle) -> None:
    """Clear what lies under walls, and draw them."""
    sheet.grey[solid] = style.paper
    if style.fill == "solid":
        sheet.grey[solid] = style.ink
        return
    if style.fill == "grey":
        sheet.grey[solid] = round(0.5 * (style.paper + style.ink))
    if style.fill == "hatched":
        rows, cols = np.indices(solid.shape, np.float32)
        along = cols * math.cos(style.hatch_angle) + rows * math.sin(style.hatch_angle)
        period = max(style.thin + 2.5, style.hatch * style.pixels_per_metre)
        sheet.grey[solid & (np.mod(along, period) < style.thin)] = style.ink
    side = 2 * style.line + 1
    core = cv2.erode(solid.astype(np.uint8), np.ones((side, side), np.uint8)) > 0
    sheet.grey[solid & ~core] = style.ink


def _draw_windows(sheet: Sheet, world: World, style: DraftingStyle, rng: np.random.Generator) -> None:
    """Draw windows in the outer walls: blank between the ends, with lines along the wall."""
    width, height = world.size
    inner = _outer_thickness(sheet, world)
    for along_x, length, low in (
        (True, width, -style.outer),
        (True, width, height - inner),
        (False, height, -style.outer),
        (False, height, width - inner),
    ):
        high = low + inner + style.outer
        count = int(length / (2.0 * style.window))
        for k in range(count):
            start = (k + 0.5) * length / count - 0.5 * style.window + rng.normal(0.0, 0.1)
            if rng.random() >= style.windows or start < 0.6 or start + style.window > length - 0.6:
                continue
            corners = _rectangle(start, low, start + style.window, high)
            corners = corners if along_x else corners[:, ::-1]
            sheet.grey[sheet.mask([corners])] = style.paper
            sheet.line(corners, style.ink, style.thin, closed=True)
            for line in range(1, style.window_lines):
                at = low + (high - low) * line / style.window_lines
                ends = np.array([(start, at), (start + style.window, at)])
                sheet.line(ends if along_x else ends[:, ::-1], style.ink, style.thin)


def _outer_thickness(sheet: Sheet, world: World) -> float:
    """Return the thickness of the thinnest outer wall [m], as the world's solids have it at its low side."""
    sides = [min(polygon.max(axis=0) - polygon.min(axis=0)) for polygon in world.obstacles if polygon.min() <= 1e-9]
    return float(min([RING, *sides]))


def _draw_door(sheet: Sheet, door: DoorGap, style: DraftingStyle, rng: np.random.Generator) -> None:
    """Draw the leaf or leaves of a door, and the arc that each describes."""
    hinged_low, into_high = rng.random(2) < 0.5
    if style.door == "open":
        return
    double = style.door == "double" and door.width > 1.1
    radius = door.width / (2.0 if double else 1.0)
    for low in (True, False) if double else (hinged_low,):
        along = door.x0 if door.along_x else door.y0
        along = along if low else along + door.width
        across = (door.y1 if into_high else door.y0) if door.along_x else (door.x1 if into_high else door.x0)
        closed_way, open_way = (1.0 if low else -1.0), (1.0 if into_high else -1.0)
        # In a frame whose first axis runs along the wall: the leaf stands open, the arc ends at the closed position.
        start, end = math.atan2(0.0, closed_way), math.atan2(open_way, 0.0)
        if abs(end - start) > math.pi:
            end += math.tau
        angles = np.linspace(start, end, 25)
        arc = np.add((along, across), radius * np.column_stack((np.cos(angles), np.sin(angles))))
        leaf = np.array([(along, across), arc[-1]])
        if not door.along_x:
            arc, leaf = arc[:, ::-1], leaf[:, ::-1]
        sheet.line(leaf, style.ink, style.line)
        if style.door != "leaf":
            sheet.line(arc, style.ink, style.thin)


def _scanned(grey: NDArray[np.uint8], style: DraftingStyle, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Blur a picture and add noise, uneven light and specks."""
    if style.blur == style.noise == style.shade == style.specks == 0.0:
        return grey
    seen = cv2.GaussianBlur(grey, (0, 0), style.blur).astype(np.float32)
    coarse = rng.normal(0.0, style.shade, (5, 5)).astype(np.float32)
    seen += cv2.resize(coarse, grey.shape[::-1], interpolation=cv2.INTER_CUBIC)
    seen += rng.normal(0.0, style.noise, grey.shape).astype(np.float32)
    specks = rng.random(grey.shape) < style.specks
    seen[cv2.dilate(specks.astype(np.uint8), np.ones((2, 2), np.uint8)) > 0] = style.ink
    return np.clip(np.rint(seen), 0.0, 255.0).astype(np.uint8)
