"""What a report shows, whatever it is of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mapquilt.report.answer import ReportAnswer

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Chart:
    """A figure under a heading, what it shows in words for those who do not see it, and what to read from it."""

    heading: str
    figure: Figure
    alt: str
    caption: str


@dataclass(frozen=True)
class Picture:
    """A PNG that lies in the folder already."""

    heading: str
    png: bytes
    alt: str
    caption: str


@dataclass(frozen=True)
class Sheet:
    """A table: its columns, whether each holds numbers, and its cells as text."""

    heading: str
    caption: str
    columns: Sequence[tuple[str, bool]]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Content:
    """``kind`` is run, data set, benchmark or study; ``settings`` are what it was made with, as words by name.

    ``charts`` and ``sheets`` are those that only this kind has; what all have is drawn from ``answers``.
    """

    kind: str
    name: str
    settings: Mapping[str, str]
    answers: tuple[ReportAnswer, ...]
    pictures: Sequence[Picture] = ()
    charts: Sequence[Chart] = ()
    sheets: Sequence[Sheet] = ()
    notes: Sequence[str] = field(default=())
