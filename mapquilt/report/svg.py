"""Figures as SVG that stands inside a page: its colours are the page's, light or dark, and its text is text."""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING

from mapquilt.viz.palette import INK, ROBOTS
from mapquilt.viz.plot_style import GRID, MUTED
from mapquilt.viz.png import default_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

THEMED = {INK: "--ink", MUTED: "--muted", GRID: "--line"} | {colour: f"--c{k}" for k, colour in enumerate(ROBOTS)}
"""Colours of figures, and the page's that take their place."""

_ID = re.compile(r'(\bid="|url\(#|xlink:href="#)')


@default_style()
def figure_svg(figure: Figure, name: str) -> str:
    """Render a figure as ``<svg>``; ``name`` makes its ids unique on the page."""
    from matplotlib import rc_context

    buffer = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
        figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    for colour, variable in THEMED.items():
        text = re.sub(re.escape(colour), f"var({variable})", text, flags=re.IGNORECASE)
    return _ID.sub(rf"\g<1>{name}-", text)
