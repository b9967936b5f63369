"""Tables of plain text."""

from __future__ import annotations

from rich import box
from rich.table import Table


def plain_table(*columns: tuple[str, bool]) -> Table:
    """Start an empty table with these columns; numbers (True) are aligned on the right, and other columns folded where
    a row is too long."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True, caption_justify="left")
    for name, number in columns:
        table.add_column(name, justify="right" if number else "left", overflow="fold")
    return table
