"""Content of a report, the same for runs, data sets, benchmarks and studies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mapping.io.safe_load import MAX_BYTES, read_limited
from mapping.io.safe_path import safe_path
from mapquilt.evaluation.evaluated_pair import OUTCOMES, EvaluatedPair

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Chart:
    """A figure under a heading, with a text alternative and a caption."""

    heading: str
    figure: Figure
    alt: str
    caption: str


@dataclass(frozen=True)
class Picture:
    """A PNG; those that are ``small`` stand beside one another, under the heading of pose graphs."""

    heading: str
    png: bytes
    alt: str
    caption: str
    small: bool = False


@dataclass(frozen=True)
class Sheet:
    """A table: its columns, True if they hold numbers, and its cells as text."""

    heading: str
    caption: str
    columns: Sequence[tuple[str, bool]]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Content:
    """``kind`` is run, data set, benchmark or study; ``settings`` are texts by name. ``answers`` have map files.

    ``charts`` and ``sheets`` are those of this kind alone; the common ones are drawn from ``answers``. ``mission``
    is the data of the 3-D view, None without a mission; ``maps_page`` is the HTML of the page on which the merged maps
    can be looked at, None without a merge.
    """

    kind: str
    name: str
    settings: Mapping[str, str]
    answers: tuple[EvaluatedPair, ...]
    pictures: Sequence[Picture] = ()
    charts: Sequence[Chart] = ()
    sheets: Sequence[Sheet] = ()
    notes: Sequence[str] = field(default=())
    mission: Mapping[str, Any] | None = None
    maps_page: str | None = None


NOT_MERGED = "not merged"


def methods_of(answers: Sequence[EvaluatedPair]) -> tuple[str, ...]:
    """List the methods that answered, in order."""
    return tuple(dict.fromkeys(one.method for one in answers if one.accepted is not None))


def outcome_rank(one: EvaluatedPair) -> int:
    """Rank outcomes as they are shown: errors first, pairs that were not merged last."""
    return len(OUTCOMES) if one.outcome is None else OUTCOMES.index(one.outcome)


def own_picture(folder: Path, name: str) -> bytes | None:
    """Read a picture of a folder for its report; None if there is none.

    Raises ``ValueError`` if it is a link out of the folder, because the report would publish another file.
    """
    if not (folder / name).is_file():
        return None
    path = safe_path(folder, name)
    if path is None:
        raise ValueError(f"{folder / name}: is a link that leads out of {folder}")
    return read_limited(path, MAX_BYTES)
