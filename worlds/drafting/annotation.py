"""Annotate a plan: names of rooms, symbols, stairs, dimensions, axes, and the frame with its title."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from worlds.drafting.sheet import Sheet
from worlds.drafting.style import DraftingStyle
from worlds.world import World

NAMES = ("OFFICE", "Room", "Store", "KITCHEN", "Bath", "Hall", "Bedroom", "Lobby", "WC", "Meeting", "Lab", "Archive")
SEAL = 1.5
"""Gaps up to this width [m] part two rooms."""
LEAST_ROOM = 2.0
"""Least area of a room that gets a name [m^2], without the cells near its walls."""


def annotate(
    sheet: Sheet, solid: NDArray[np.bool_], world: World, style: DraftingStyle, rng: np.random.Generator
) -> None:
    """Draw everything but walls, doors, windows and the world's own furniture."""
    middles = _room_middles(solid, sheet, world)
    for number, (x, y, clear) in enumerate(middles):
        for _ in range(int(rng.poisson(style.symbols))):
            away = rng.uniform(-0.8, 0.8, 2) * clear
            _symbol(sheet, (x + float(away[0]), y + float(away[1])), style, rng)
        if style.names and clear > 2.0 * style.letters:
            name = NAMES[int(rng.integers(len(NAMES)))]
            text = name if rng.random() < 0.5 else f"{name} {100 + number}"
            upright = bool(rng.random() < 0.1)
            sheet.text(text, (x, y), style.letters, style.ink, style.thin, upright)
            if style.areas and not upright:
                below = (x, y - 1.7 * style.letters)
                sheet.text(f"{(2.0 * clear) ** 2:.1f} m2", below, 0.7 * style.letters, style.ink, style.thin)
    if middles:
        by_room = sorted(middles, key=lambda each: -each[2])
        for x, y, clear in by_room[: style.stairs]:
            if clear > 1.2:
                _stairs(sheet, (x, y + 0.3 * clear), style, rng)
    if style.grid_axes:
        _axes(sheet, world, style)
    if style.dimensions:
        _dimensions(sheet, world, style, rng)
    if style.frame:
        _frame(sheet, world, style)


def _room_middles(solid: NDArray[np.bool_], sheet: Sheet, world: World) -> list[tuple[float, float, float]]:
    """Return the point of greatest clearance in each room: x, y and the clearance [m]."""
    width, height = world.size
    inside = sheet.mask([np.array([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)])])
    depth = cv2.distanceTransform((inside & ~solid).astype(np.uint8), cv2.DIST_L2, 5) * sheet.frame.resolution
    count, labels = cv2.connectedComponents((depth > 0.5 * SEAL).astype(np.uint8))
    found = []
    for label in range(1, count):
        room = labels == label
        if np.count_nonzero(room) * sheet.frame.resolution**2 < LEAST_ROOM:
            continue
        row, col = np.unravel_index(np.argmax(np.where(room, depth, 0.0)), depth.shape)
        x, y = sheet.frame.metres_from_cells([(depth.shape[0] - 1 - row, col)])[0].tolist()
        found.append((x, y, float(depth[row, col])))
    return found


def _symbol(sheet: Sheet, middle: tuple[float, float], style: DraftingStyle, rng: np.random.Generator) -> None:
    """Draw a table with a cross, a basin in a rectangle, a bath tub or a round table."""
    x, y = middle
    long, deep = rng.uniform(0.5, 1.8), rng.uniform(0.4, 0.9)
    if rng.random() < 0.5:
        long, deep = deep, long
    corners = np.array([(x, y), (x + long, y), (x + long, y + deep), (x, y + deep)])
    centre, kind = (x + 0.5 * long, y + 0.5 * deep), int(rng.integers(4))
    if kind < 3:
        sheet.line(corners, style.ink, style.thin, closed=True)
    if kind == 0:
        sheet.line(corners[::2], style.ink, style.thin)
        sheet.line(corners[1::2], style.ink, style.thin)
    elif kind == 1:
        sheet.arc(centre, 0.35 * min(long, deep), 0.0, 2.0 * np.pi, style.ink, style.thin)
    elif kind == 2:
        small = np.array(centre) + 0.8 * (corners - centre)
        sheet.line(small, style.ink, style.thin, closed=True)
    else:
        sheet.arc(centre, 0.5 * min(long, deep), 0.0, 2.0 * np.pi, style.ink, style.thin)


def _stairs(sheet: Sheet, middle: tuple[float, float], style: DraftingStyle, rng: np.random.Generator) -> None:
    """Draw a flight of stairs with an arrow."""
    treads, going, wide = int(rng.integers(6, 13)), rng.uniform(0.25, 0.3), rng.uniform(0.9, 1.2)
    upright = bool(rng.random() < 0.5)
    length = treads * going

    def draw(points: list[tuple[float, float]]) -> None:
        local = np.array(points) - (0.5 * length, 0.5 * wide)
        sheet.line(np.add(middle, local[:, ::-1] if upright else local), style.ink, style.thin)

    for k in range(treads + 1):
        draw([(k * going, 0.0), (k * going, wide)])
    draw([(0.0, 0.0), (length, 0.0)])
    draw([(0.0, wide), (length, wide)])
    draw([(0.1, 0.5 * wide), (length - 0.1, 0.5 * wide)])
    draw([(length - 0.35, 0.35 * wide), (length - 0.1, 0.5 * wide), (length - 0.35, 0.65 * wide)])


def _dimensions(sheet: Sheet, world: World, style: DraftingStyle, rng: np.random.Generator) -> None:
    """Draw dimension lines with ticks and numbers below and to the left of the building."""
    for along_x, length in ((True, world.size[0]), (False, world.size[1])):
        for away, pieces in ((1.1, int(rng.integers(3, 9))), (2.0, 1)):
            at = -style.outer - away
            borders = np.sort(np.concatenate(([0.0, length], rng.uniform(0.05, 0.95, pieces - 1) * length)))

            def draw(points: list[tuple[float, float]], along_x: bool = along_x) -> None:
                ends = np.array(points)
                sheet.line(ends if along_x else ends[:, ::-1], style.ink, style.thin)

            draw([(-0.3, at), (length + 0.3, at)])
            for border in borders.tolist():
                draw([(border - 0.12, at - 0.12), (border + 0.12, at + 0.12)])
                draw([(border, at - 0.25), (border, -style.outer - 0.3)])
            for start, end in zip(borders[:-1].tolist(), borders[1:].tolist(), strict=True):
                if end - start > 4.0 * style.letters:
                    middle = (0.5 * (start + end), at + 0.6 * style.letters)
                    place = middle if along_x else (middle[1] - 1.2 * style.letters, middle[0])
                    text = f"{end - start:.2f}"
                    sheet.text(text, place, 0.8 * style.letters, style.ink, style.thin, upright=not along_x)


def _axes(sheet: Sheet, world: World, style: DraftingStyle) -> None:
    """Draw dash-dotted axes of the building's grid, with a letter or number in a circle at their ends."""
    for along_x, length, across in ((False, world.size[0], world.size[1]), (True, world.size[1], world.size[0])):
        for k, at in enumerate(np.linspace(0.0, length, 2 + int(length / 7.0)).tolist()):
            for start in np.arange(-1.0, across + 1.0, 0.9).tolist():
                ends = np.array([(at, start), (at, min(start + 0.6, across + 1.0))])
                sheet.line(ends[:, ::-1] if along_x else ends, style.ink, 1)
            place = (across + 1.4, at) if along_x else (at, across + 1.4)
            sheet.arc(place, 0.4, 0.0, 2.0 * np.pi, style.ink, style.thin)
            sheet.text(chr(65 + k % 26) if along_x else str(k + 1), place, 0.35, style.ink, style.thin)


def _frame(sheet: Sheet, world: World, style: DraftingStyle) -> None:
    """Draw a frame about the sheet and a title block in its lower right corner."""
    width, height = world.size
    low, right, high = -3.3, width + 3.3, height + 3.3
    sheet.line([(low, low), (right, low), (right, high), (low, high)], style.ink, style.line + 1, closed=True)
    wide, tall = min(6.0, 0.4 * width), 1.4
    left = right - wide
    sheet.line([(left, low), (left, low + tall), (right, low + tall)], style.ink, style.line)
    sheet.line([(left, low + 0.5 * tall), (right, low + 0.5 * tall)], style.ink, style.thin)
    sheet.text("GROUND FLOOR", (left + 0.5 * wide, low + 0.72 * tall), 0.35, style.ink, style.thin)
    sheet.text("A-101  1:100", (left + 0.5 * wide, low + 0.25 * tall), 0.3, style.ink, style.thin)
