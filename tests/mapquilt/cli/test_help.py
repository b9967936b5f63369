"""Help and tables fit 80 columns, show whole descriptions, and give an example of each verb."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from typer.core import TyperGroup

from mapquilt.cli.app import VERBS, load_verb, run
from mapquilt.viz.text_table import plain_table


def commands() -> Iterator[tuple[str, ...]]:
    """Every verb, and every command below it."""
    for verb in VERBS:
        yield (verb,)
        command: Any = load_verb(verb)
        if isinstance(command, TyperGroup):
            yield from ((verb, name) for name in command.commands)


@pytest.mark.parametrize("names", [(), *commands()], ids=" ".join)
def test_help_fits_80_columns_and_gives_an_example(
    names: tuple[str, ...], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert run([*names, "--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    example = " ".join(("Example: mapquilt", *names))
    assert [line for line in lines if line.startswith(f"  {example}")]
    assert [line for line in lines if line.endswith("...") and not line.startswith("Usage")] == []


def test_the_table_of_lidars_fits_80_columns(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["lidars"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert "…" not in "".join(lines)


def test_names_are_folded_and_never_cut(capsys: pytest.CaptureFixture[str]) -> None:
    from mapquilt.cli.tables import print_table

    name, number = "x" * 100 + "end", "1234567.125"
    table = plain_table(("name", False), *((f"long heading {k}", True) for k in range(5)))
    table.add_row(name, *[number] * 5)
    print_table(table)
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert sum(line.count(number) for line in lines) == 5
    assert "".join(line[:20].split()[0] for line in lines if line.strip().startswith(("x", "e"))) == name
