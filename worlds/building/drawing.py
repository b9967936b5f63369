"""Describe the layout that a family draws."""

from __future__ import annotations

from dataclasses import dataclass

from mapping.geometry.se2 import SE2
from worlds.polygon import Polygon


@dataclass(frozen=True, eq=False)
class WorldDrawing:
    """Hold ``obstacles`` as in ``World``, and optionally ``starts``, a ``fence``, and the number of separate ``parts``
    of the floor."""

    obstacles: tuple[Polygon, ...]
    starts: tuple[SE2, ...] = ()
    fence: Polygon | None = None
    parts: int = 1


def require_size(family: str, width: float, height: float, least: tuple[float, float]) -> None:
    """Raise ``ValueError`` with the value if a size [m] is too small for the family."""
    for name, value, bound in zip(("width", "height"), (width, height), least, strict=True):
        if not value >= bound:
            raise ValueError(f"{family}: {name} is {value:g} m, too small: needs {bound:g} m")
