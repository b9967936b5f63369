"""What a family of worlds draws."""

from __future__ import annotations

from dataclasses import dataclass

from mapping.geometry.se2 import SE2
from worlds.polygon import Polygon


@dataclass(frozen=True, eq=False)
class WorldDrawing:
    """``obstacles`` as ``World`` has them, and where the family brings them its ``starts``, its
    ``fence`` and the number of ``parts`` that its floor falls into on purpose."""

    obstacles: tuple[Polygon, ...]
    starts: tuple[SE2, ...] = ()
    fence: Polygon | None = None
    parts: int = 1


def require_size(family: str, width: float, height: float, least: tuple[float, float]) -> None:
    """Raise ``ValueError`` naming the value where a size [m] is too small to hold the family."""
    for name, value, bound in zip(("width", "height"), (width, height), least, strict=True):
        if not value >= bound:
            raise ValueError(f"{family}: {name} is {value:g} m, too small: needs {bound:g} m")
