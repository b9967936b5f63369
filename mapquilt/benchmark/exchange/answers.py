"""Answers of another program to the pairs of a benchmark: a CSV file with one row per pair."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from mapping.geometry.similarity2 import Similarity2
from mapping.io.safe_load import MAX_BYTES, read_limited, reading
from mapping.wording import counted

TRANSFORM = ("scale", "rotation_deg", "tx", "ty")
COLUMNS = ("pair", *TRANSFORM, "confidence", "accepted", "seconds")

ANSWERED = " from answers"
"""Ending of the title of a method that another program ran."""

FARTHEST = 1e9
"""Largest translation [pixels] and scale, and the inverse of the smallest scale: the errors stay finite."""

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")
_FLAGS = {"1": True, "true": True, "0": False, "false": False}


@dataclass(frozen=True)
class GivenAnswer:
    """One program's answer to one pair.

    - ``method``: its title in tables;
    - ``target_from_source``: from pixels of the source's image to pixels of the target's, y down, centres at integers;
      None if the program found nothing;
    - ``confidence``: 0 to 1; ``seconds``: of the pair, as the program measured them, or None.
    """

    method: str
    target_from_source: Similarity2 | None
    confidence: float
    accepted: bool
    seconds: float | None


def named_files(given: Collection[str], taken: Collection[str]) -> dict[str, Path]:
    """Read ``NAME=FILE``, or a file whose name without extension is that of its method.

    Raises ``ValueError`` for a name that is doubled, ``taken`` by a method, or no name of a file.
    """
    found: dict[str, Path] = {}
    for each in given:
        name, equals, file = each.partition("=")
        if not equals or Path(each).is_file():
            name, file = Path(each).stem, each
        if not _NAME.fullmatch(name):
            raise ValueError(
                f"--answers {each}: the name {name!r} must be letters, digits, '_', '.' and '-': give NAME=FILE"
            )
        if name in found or name in taken:
            raise ValueError(f"--answers {each}: there is another method {name!r}: give NAME=FILE with another name")
        found[name] = Path(file)
    return found


def read_answers(file: Path, name: str, pairs: Collection[str]) -> dict[str, GivenAnswer]:
    """Read the answers of the method ``name`` to exactly these pairs, by the name of the pair.

    Raises ``ValueError`` in one line naming the file and the row that is missing, doubled, of an unknown pair or
    wrong; ``OSError`` if the file cannot be read.
    """
    with reading(file):
        text = read_limited(file, MAX_BYTES).decode("utf-8-sig")
        lines = csv.DictReader(io.StringIO(text, newline=""), restval="")
        lacking = [column for column in COLUMNS if column not in (lines.fieldnames or ())]
        if lacking:
            raise ValueError(f"has no column {lacking[0]!r}; its first line must name {', '.join(COLUMNS)}")
        answers: dict[str, GivenAnswer] = {}
        first: dict[str, int] = {}
        for row in lines:
            pair, number = row["pair"].strip(), lines.line_num
            if pair not in pairs:
                raise ValueError(f"line {number}: pair {pair[:100]!r} is unknown, must be one of those of the export")
            if pair in answers:
                raise ValueError(f"line {number}: pair {pair} has a row on line {first[pair]} already; keep one")
            try:
                answers[pair] = _answer(name, row)
            except ValueError as error:
                raise ValueError(f"line {number}: pair {pair}: {error}") from None
            first[pair] = number
        _refuse_missing(answers, pairs)
    return answers


def _refuse_missing(answers: Collection[str], pairs: Collection[str]) -> None:
    missing = [pair for pair in pairs if pair not in answers]
    if missing:
        more = f" and {counted(len(missing) - 1, 'other pair')}" if len(missing) > 1 else ""
        raise ValueError(
            f"has no row for pair {missing[0]}{more}; a pair without an answer has accepted 0 and an empty transform"
        )


def _answer(name: str, row: Mapping[str, str]) -> GivenAnswer:
    accepted = _FLAGS.get(row["accepted"].strip().lower())
    if accepted is None:
        raise ValueError(f"accepted is {row['accepted'][:100]!r}, must be 1 or 0")
    given = [column for column in TRANSFORM if row[column].strip()]
    transform = None
    if given:
        scale, turn, x, y = (_number(row, column) for column in TRANSFORM)
        if not 1.0 / FARTHEST <= scale <= FARTHEST:
            raise ValueError(f"scale is {scale:g}, must be positive; leave the transform empty if nothing was found")
        if max(abs(x), abs(y)) > FARTHEST:
            raise ValueError(f"tx, ty are {x:g}, {y:g} pixels, must lie within {FARTHEST:g}")
        transform = Similarity2(x, y, math.radians(math.remainder(turn, 360.0)), scale)
    elif accepted:
        raise ValueError(f"is accepted without a transform: give {', '.join(TRANSFORM)}, or accepted 0")
    confidence = _number(row, "confidence")
    if not 0.0 <= confidence <= 1.0:
        raise ValueError(f"confidence is {confidence:g}, must be 0 to 1")
    seconds = _number(row, "seconds") if row["seconds"].strip() else None
    if seconds is not None and seconds < 0.0:
        raise ValueError(f"seconds is {seconds:g}, must not be negative; leave it empty if it was not measured")
    return GivenAnswer(f"{name}{ANSWERED}", transform, confidence, accepted, seconds)


def _number(row: Mapping[str, str], column: str) -> float:
    try:
        value = float(row[column])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{column} is {row[column].strip()[:100]!r}, must be a number")
    return value
