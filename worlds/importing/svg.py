"""Read drawings in SVG by svgelements: strokes are walls, dark fills are solids."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from mapping.io.safe_load import read_limited, reading, refuse_entities
from mapping.wording import counted
from worlds.importing.cells import DARK
from worlds.importing.solids import as_solid, chain, walls, world_from_solids
from worlds.polygon import Polygon
from worlds.world import MAX_COMPARED, World

THINNEST = 0.05
"""Least thickness of a wall [m]; a thinner stroke is drawn as a line, not to scale."""
STEPS = 12
"""Segments that replace a curve."""
MAX_ELEMENTS = 200_000
"""Most elements of an SVG file, copies included."""
MAX_BYTES = 2**26
"""Most bytes of an SVG file."""


def read_svg(path: Path, resolution: float) -> tuple[World, tuple[str, ...]]:
    """Read a drawing of ``resolution`` [m/pixel], in pixels of 1/96 inch as a browser shows it.

    A dark stroke is a wall as thick as the stroke, a dark fill a solid; light ones, texts and pictures are left out.
    Returns the world, and notes. Raises ``ValueError`` if the file is no SVG, ``ImportError`` without svgelements.
    """
    try:
        import svgelements
    except ImportError:
        raise ImportError("an SVG drawing needs svgelements: pip install 'mapquilt[plans]'") from None
    data = read_limited(path, MAX_BYTES)
    refuse_entities(data)
    _refuse_copies(ET.fromstring(data))
    with reading("is no SVG drawing"):
        drawing = svgelements.SVG.parse(io.BytesIO(data), reify=False, ppi=96.0)
    solids: list[Polygon] = []
    crossed = compared = 0
    for shape in drawing.elements(lambda each: isinstance(each, svgelements.Shape)):
        if shape.values.get("visibility") == "hidden" or shape.values.get("display") == "none":
            continue
        for part in abs(svgelements.Path(shape)).as_subpaths():
            points, closed = _points(svgelements, svgelements.Path(part))
            points = points * (resolution, -resolution)
            if _is_dark(shape.fill):
                compared += len(points) ** 2
                if compared > MAX_COMPARED:
                    raise ValueError("the fills have more corners than can be compared; simplify the drawing")
                filled = as_solid(points)
                crossed += filled is None and len(points) > 2
                solids += [] if filled is None else [filled]
            if _is_dark(shape.stroke):
                thickness = max(THINNEST, float(shape.implicit_stroke_width or 0.0) * resolution)
                solids += walls(chain(points, closed), thickness)
    notes = (
        (f"left out {counted(crossed, 'fill that crosses itself', 'fills that cross themselves')}",) if crossed else ()
    )
    return world_from_solids(path.stem, solids), notes


def _refuse_copies(root: ET.Element) -> None:
    """Raise ``ValueError`` if ``<use>`` copies elements to more than ``MAX_ELEMENTS``, or an element into itself."""
    by_name = {each.get("id"): each for each in root.iter() if each.get("id")}
    counts: dict[ET.Element, int] = {}

    def count(element: ET.Element, around: frozenset[ET.Element]) -> int:
        if element in around:
            raise ValueError("an element is a copy of itself")
        if element not in counts:
            reference = element.get("href") or element.get("{http://www.w3.org/1999/xlink}href") or ""
            copied = by_name.get(reference.removeprefix("#")) if element.tag.endswith("use") else None
            inner = around | {element}
            counts[element] = 1 + sum(count(each, inner) for each in (*element, *([] if copied is None else [copied])))
        return counts[element]

    if count(root, frozenset()) > MAX_ELEMENTS:
        raise ValueError(f"has {count(root, frozenset())} elements with their copies, must have at most {MAX_ELEMENTS}")


def _points(svgelements: Any, path: Any) -> tuple[NDArray[np.float64], bool]:
    """Return the corners of a sub-path (N, 2) in pixels, y down, and whether it closes."""
    points: list[tuple[float, float]] = []
    closed = False
    for segment in path:
        if isinstance(segment, svgelements.Close):
            closed = True
        elif isinstance(segment, svgelements.Move | svgelements.Line):
            points.append((segment.end.x, segment.end.y))
        else:
            steps = (segment.point(step / STEPS) for step in range(1, STEPS + 1))
            points += [(point.x, point.y) for point in steps]
    return np.array(points).reshape(-1, 2), closed


def _is_dark(colour: Any) -> bool:
    if colour is None or colour.value is None or not colour.opacity:
        return False
    return bool(0.299 * colour.red + 0.587 * colour.green + 0.114 * colour.blue < DARK)
