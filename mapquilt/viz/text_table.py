"""Tables of plain text, whose long names are folded after their separators."""

from __future__ import annotations

import re
from collections.abc import Iterator

from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

_WORD = re.compile(r"(?:<- )?\S+")
_PIECE = re.compile(r"[^_/.\-]*[_/.\-]+|[^_/.\-]+")
"""A part of a name with the separators behind it."""

UNLIMITED = 10_000
"""Width at which no table is folded."""

LONGEST_PIECE = 16
"""Greatest width that a column of names keeps if a table is too wide."""


class PlainTable(Table):
    """A table that folds its text columns between words and behind separators, and of the others the header alone."""

    def add_row(self, *cells: RenderableType | None, **options: object) -> None:
        folded = (
            FoldedText(cell) if isinstance(cell, str) and not column.no_wrap else cell
            for column, cell in zip(self.columns, cells, strict=True)
        )
        super().add_row(*folded, **options)  # type: ignore[arg-type]

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        if self.__rich_measure__(console, options.update(max_width=UNLIMITED)).maximum > options.max_width:
            for column in self.columns:
                if column.no_wrap:
                    lines = [line for cell in column.cells for line in str(cell).splitlines()]
                    width = max(column.min_width or 0, *map(cell_len, lines), 0)
                    column.header = "\n".join(folded(str(column.header), width))
        yield from super().__rich_console__(console, options)


class FoldedText:
    """A text that folds between words, and a longer word behind one of ``_ / . -``."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __rich_measure__(self, console: Console, options: ConsoleOptions) -> Measurement:
        lines = self.text.splitlines() or [""]
        pieces = [piece for line in lines for word in _WORD.findall(line) for piece in _PIECE.findall(word)]
        least = min(LONGEST_PIECE, max(map(cell_len, pieces), default=0))
        return Measurement(least, max(map(cell_len, lines))).clamp(max_width=options.max_width)

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
        least = max((cell_len(word) for word in name.split()), default=0)
        table.add_column(name, justify="right" if number else "left", overflow="fold", no_wrap=number, min_width=least)
    return table
