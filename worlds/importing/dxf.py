"""Read drawings in DXF by ezdxf: every line, polyline, arc and curve of the model space is a wall."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.io.safe_load import reading, require_file
from worlds.floor import LARGEST
from worlds.importing.solids import chain, walls, world_from_solids
from worlds.world import World

THICKNESS = 0.05
"""Thickness of the walls [m]: drawings show both faces of a wall as lines."""
SAG = 0.01
"""Greatest distance between a curve and the segments that replace it [m]."""
MAX_BYTES = 2**27
"""Most bytes of a DXF file."""
MAX_ENTITIES = 20_000
"""Most entities, those of blocks counted each time: twice the walls that can be simulated."""
DRAWN = frozenset(("LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE"))


def read_dxf(path: Path, metres_per_unit: float | None) -> tuple[World, tuple[str, ...]]:
    """Read the lines and curves of a DXF drawing, also those in blocks, as walls.

    Layers that are off or frozen, texts, dimensions and hatches are left out. The size comes from the unit of the
    drawing (``$INSUNITS``), unless ``metres_per_unit`` is given. Returns the world, and notes. Raises ``ValueError`` if
    the file is no DXF, or states no unit and none is given; ``ImportError`` without ezdxf.
    """
    try:
        import ezdxf
        from ezdxf import disassemble, units
        from ezdxf import path as curves
        from ezdxf.enums import InsertUnits
    except ImportError:
        raise ImportError("a DXF drawing needs ezdxf: pip install 'mapquilt[plans]'") from None
    require_file(path, MAX_BYTES)
    with reading("is no DXF drawing", ezdxf.DXFError, StopIteration):  # type: ignore[attr-defined]
        drawing = ezdxf.readfile(path)  # type: ignore[attr-defined]
        entities = list(islice(disassemble.recursive_decompose(drawing.modelspace()), MAX_ENTITIES + 1))
        if len(entities) > MAX_ENTITIES:
            raise ValueError(f"it has more than {MAX_ENTITIES} entities, those of blocks counted each time")
        drawn = [each for each in entities if each.dxftype() in DRAWN and _is_shown(drawing, each)]
        shapes = [curves.make_path(each) for each in drawn]
    if metres_per_unit is None:
        if not drawing.units:
            raise ValueError(
                "the drawing states no unit ($INSUNITS); give --plan-resolution (plan_resolution of a data set), in "
                "metres a unit"
            )
        metres_per_unit = units.conversion_factor(InsertUnits(drawing.units), InsertUnits.Meters)
    segments: list[NDArray[np.float64]] = []
    for shape in shapes:
        corners = np.array([(point.x, point.y) for point in shape.control_vertices()]).reshape(-1, 2)
        if len(corners) and not np.ptp(corners, axis=0).max() * metres_per_unit <= LARGEST:
            raise ValueError(f"a line or curve is longer than {LARGEST:g} m, the largest plan; check the unit")
        points = [(point.x, point.y) for point in shape.flattening(SAG / metres_per_unit)]
        if len(points) > 1:
            segments.extend(chain(np.array(points) * metres_per_unit, closed=False))
    note = f"a unit of the drawing is {metres_per_unit:g} m"
    return world_from_solids(path.stem, walls(segments, THICKNESS)), (note,)


def _is_shown(drawing: Any, entity: Any) -> bool:
    layer = drawing.layers.get(entity.dxf.layer) if entity.dxf.layer in drawing.layers else None
    return layer is None or not (layer.is_off() or layer.is_frozen())
