"""Tables of plain text, whose long names are folded after their separators."""

from __future__ import annotations

import re
from collections.abc import Iterator

from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.measure import Measurement
from rich.table import Column, Table
from rich.text import Text

_WORD = re.compile(r"(?:<- )?\S+")
_PIECE = re.compile(r"[^_/.\-]*[_/.\-]+|[^_/.\-]+")
"""A part of a name with the separators behind it."""

UNLIMITED = 10_000
"""Width at which no table is folded."""

LEAST_WIDTH = 4
"""Width that a column of text keeps in a table of many columns, even if its words are cut."""


class PlainTable(Table):
    """A table that fits its width: columns of text are folded between words and behind separators, the widest first,
    and of columns of numbers the header alone."""

    def add_row(self, *cells: RenderableType | None, **options: object) -> None:
        folded = (
            FoldedText(cell) if isinstance(cell, str) and column.justify == "left" else cell
            for column, cell in zip(self.columns, cells, strict=True)
        )
        super().add_row(*folded, **options)  # type: ignore[arg-type]

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        natural = [max(map(cell_len, _lines(column)), default=0) for column in self.columns]
        whole = self.__rich_measure__(console, options.update(max_width=UNLIMITED)).maximum
        if whole > options.max_width:
            widths = _fitting(natural, list(map(_least, self.columns)), options.max_width - (whole - sum(natural)))
            for column, width in zip(self.columns, widths, strict=True):
                column.width = width
        yield from super().__rich_console__(console, options)


def _lines(column: Column) -> list[str]:
    return [line for text in (column.header, *column.cells) for line in _text(text).splitlines()]


def _text(cell: RenderableType) -> str:
    return cell.text if isinstance(cell, FoldedText) else str(cell)


def _least(column: Column) -> int:
    """Return the width that a column needs: its longest word, or part of a name; numbers are kept whole."""
    cells = [line for cell in column.cells for line in _text(cell).splitlines()]
    if column.justify == "left":
        cells = [piece for line in cells for word in _WORD.findall(line) for piece in _PIECE.findall(word)]
    return max(map(cell_len, (*str(column.header).split(), *cells)), default=0)


def _fitting(widths: list[int], least: list[int], available: int) -> list[int]:
    """Narrow the widest columns until they fit, first to their least widths, and then below."""
    fitting = list(widths)
    for bounds in (least, [min(bound, LEAST_WIDTH) for bound in least]):
        while sum(fitting) > available:
            slack = [width if width > bound else 0 for width, bound in zip(fitting, bounds, strict=True)]
            if not any(slack):
                break
            fitting[slack.index(max(slack))] -= 1
    return fitting


class FoldedText:
    """A text that folds between words, and a longer word behind one of ``_ / . -``."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __rich_measure__(self, console: Console, options: ConsoleOptions) -> Measurement:
        longest = max(map(cell_len, self.text.splitlines()), default=0)
        return Measurement(min(LEAST_WIDTH, longest), longest).clamp(max_width=options.max_width)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        yield Text("\n".join(folded(self.text, options.max_width)), overflow="fold")


def folded(text: str, width: int) -> list[str]:
    """Fold a text to lines of that width: between words, else behind separators, else anywhere."""
    lines = []
    for line in text.splitlines() or [""]:
        lines.append("")
        for word in _WORD.findall(line):
            joined = f"{lines[-1]} {word}".strip()
            if cell_len(joined) <= width:
                lines[-1] = joined
                continue
            lines += [""] if lines[-1] else []
            for piece in _PIECE.findall(word) if cell_len(word) > width else [word]:
                if lines[-1] and cell_len(lines[-1] + piece) > width:
                    lines.append("")
                lines[-1] += piece
    return lines


def plain_table(*columns: tuple[str, bool]) -> PlainTable:
    """Start an empty table with these columns; numbers (True) are aligned on the right and kept whole, and other
    columns are folded where a row is too long."""
    table = PlainTable(box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True, caption_justify="left")
    for name, number in columns:
        table.add_column(name, justify="right" if number else "left", overflow="fold")
    return table
