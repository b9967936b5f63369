"""Figures as PNG bytes, in one style whatever the user's settings of matplotlib are."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@contextmanager
def default_style() -> Iterator[None]:
    """Draw with matplotlib's defaults instead of a matplotlibrc, and names as text instead of formulas.

    Every function that makes a figure is decorated with this.
    """
    from matplotlib import rc_context, rcParamsDefault

    defaults = {name: value for name, value in rcParamsDefault.items() if not name.startswith("backend")}
    with rc_context({**defaults, "text.parse_math": False}):
        yield


@default_style()
def figure_png(figure: Figure) -> bytes:
    """Render a figure, without the metadata that differ between versions of matplotlib."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()
