"""Styles of architects' drawings, each with a range that a seed draws from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from mapping.wording import did_you_mean

WallFill = Literal["hollow", "solid", "hatched", "grey"]


@dataclass(frozen=True)
class DraftingStyle:
    """Describe a drawing; lengths on paper in pixels, in the building in metres.

    - ``fill`` of the walls: blank between two lines, black, hatched, or grey between two lines;
    - ``pixels_per_metre``; ``line``, ``thin``: width of walls' outlines and of all other lines;
    - ``hatch``: distance of hatch lines [m], ``hatch_angle`` [rad];
    - ``outer``: extra thickness of the outer walls, outwards [m];
    - ``door``: symbol of doors; ``windows``: probability of a window in each stretch of outer wall of ``window`` [m];
      ``window_lines``: number of lines along it;
    - ``furniture``: probability that a piece is drawn; ``moved``: standard deviation of its displacement [m];
    - ``symbols``: expected number of sanitary and furniture symbols that the world does not have, for each room;
    - ``stairs``: number of flights; ``names``, ``areas``, ``dimensions``, ``grid_axes``, ``frame``: drawn or not;
    - ``letters``: height of text [m];
    - ``ink``, ``paper``: grey levels; ``turn``: rotation of the sheet [rad]; ``blur`` [pixels], ``noise`` [grey
      levels], ``shade`` [grey levels]: standard deviations of the scanner's faults; ``specks``: share of pixels.
    """

    fill: WallFill
    pixels_per_metre: float
    line: int
    thin: int
    hatch: float
    hatch_angle: float
    outer: float
    door: Literal["arc", "leaf", "double", "open"]
    windows: float
    window: float
    window_lines: int
    furniture: float
    moved: float
    symbols: float
    stairs: int
    names: bool
    areas: bool
    dimensions: bool
    grid_axes: bool
    frame: bool
    letters: float
    ink: int
    paper: int
    turn: float
    blur: float
    noise: float
    shade: float
    specks: float


def _common(rng: np.random.Generator, fill: WallFill) -> DraftingStyle:
    """Draw what every style varies."""
    pixels_per_metre = float(rng.uniform(24.0, 60.0))
    line = int(rng.integers(1, max(1, int(0.05 * pixels_per_metre)) + 1))
    door = rng.choice(["arc", "arc", "arc", "leaf", "double", "open"])
    right_angle = float(rng.integers(4)) * np.pi / 2.0
    return DraftingStyle(
        fill=fill,
        pixels_per_metre=pixels_per_metre,
        line=line,
        thin=max(1, line - int(rng.integers(0, 2))),
        hatch=float(rng.uniform(0.07, 0.16)),
        hatch_angle=float(rng.choice([np.pi / 4.0, -np.pi / 4.0, np.pi / 6.0])),
        outer=float(rng.choice([0.0, 0.1, 0.2, 0.25])),
        door=str(door),  # type: ignore[arg-type]
        windows=float(rng.uniform(0.3, 0.8)),
        window=float(rng.uniform(1.0, 2.2)),
        window_lines=int(rng.integers(1, 4)),
        furniture=float(rng.choice([0.0, 0.0, 0.5, 0.9])),
        moved=float(rng.uniform(0.1, 0.6)),
        symbols=float(rng.choice([0.0, 0.6, 1.5])),
        stairs=int(rng.integers(0, 3)),
        names=bool(rng.random() < 0.85),
        areas=bool(rng.random() < 0.6),
        dimensions=bool(rng.random() < 0.75),
        grid_axes=bool(rng.random() < 0.25),
        frame=bool(rng.random() < 0.6),
        letters=float(rng.uniform(0.22, 0.4)),
        ink=int(rng.integers(0, 50)),
        paper=int(rng.integers(245, 256)),
        turn=right_angle,
        blur=0.0,
        noise=0.0,
        shade=0.0,
        specks=0.0,
    )


def _scanned(rng: np.random.Generator) -> DraftingStyle:
    """Draw a plan of any fill as a scanner returns it: askew, blurred, noisy, on greyish paper."""
    fills: tuple[WallFill, ...] = ("hollow", "solid", "hatched", "grey")
    style = _common(rng, fills[int(rng.integers(4))])
    return DraftingStyle(
        **{
            **style.__dict__,
            "ink": int(rng.integers(30, 90)),
            "paper": int(rng.integers(200, 246)),
            "turn": style.turn + float(rng.uniform(-0.12, 0.12)),
            "blur": float(rng.uniform(0.5, 1.1)),
            "noise": float(rng.uniform(3.0, 12.0)),
            "shade": float(rng.uniform(2.0, 10.0)),
            "specks": float(rng.uniform(0.0, 0.0008)),
        }
    )


STYLES: Mapping[str, Callable[[np.random.Generator], DraftingStyle]] = MappingProxyType(
    {
        "hollow": lambda rng: _common(rng, "hollow"),
        "solid": lambda rng: _common(rng, "solid"),
        "hatched": lambda rng: _common(rng, "hatched"),
        "grey": lambda rng: _common(rng, "grey"),
        "scanned": _scanned,
    }
)
"""Name of each style, and the function that draws its details."""


def draw_style(name: str, rng: np.random.Generator) -> DraftingStyle:
    """Draw the details of a style. Raises ``ValueError`` if the name is unknown."""
    if name not in STYLES:
        raise ValueError(f"style is {name!r}, must be one of {', '.join(STYLES)}{did_you_mean(name, STYLES)}")
    return STYLES[name](rng)
