"""MkDocs hook: write the references of the command line and of the settings from the code, and the leaderboard."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.leaderboard.table import leaderboard_tables
from mapquilt.cli.app import VERBS, load_verb, run
from mapquilt.leaves import get_leaf, leaf_names
from mapquilt.live.settings import LiveSettings
from mapquilt.settings import ExperimentConfig

CLI_PAGE, SETTINGS_PAGE, LEADERBOARD_PAGE = "reference/cli.md", "reference/settings.md", "leaderboard.md"


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Append the help of every verb, the table of all settings, or the results of all methods, to their page."""
    if page.file.src_uri == LEADERBOARD_PAGE:
        return markdown + "\n" + leaderboard_tables()
    if page.file.src_uri == CLI_PAGE:
        return markdown + "".join(map(_section, _commands()))
    return markdown + settings_table() if page.file.src_uri == SETTINGS_PAGE else markdown


def settings_table() -> str:
    """Tabulate every leaf of the settings with its default, and then those of a live merge."""
    live = [name for name in leaf_names(LiveSettings()) if not name.startswith("merge.")]
    of_live = _table(LiveSettings(), live)
    return f"{_table(ExperimentConfig())}\nOf `mapquilt live`, beside those of `merge`:\n{of_live}"


def _table(tree: Any, names: Iterable[str] | None = None) -> str:
    rows = [f"| `{name}` | {_text(get_leaf(tree, name))} |" for name in names or leaf_names(tree)]
    return "\n".join(("", "| setting | default |", "|---|---|", *rows, ""))


def _text(value: Any) -> str:
    if isinstance(value, tuple):
        return ":".join(map(_text, value))
    if isinstance(value, float):
        return f"{value:g}"
    return str(value).lower() if value is None or isinstance(value, bool) else str(value)


def _commands() -> list[tuple[str, ...]]:
    commands: list[tuple[str, ...]] = []
    for name in VERBS:
        verb = load_verb(name)
        if getattr(verb, "invoke_without_command", True):
            commands.append((name,))
        commands += [(name, sub) for sub in getattr(verb, "commands", {})]
    return commands


def _section(words: tuple[str, ...]) -> str:
    return f"\n## mapquilt {' '.join(words)}\n\n```text\n{help_of(words)}```\n"


def help_of(words: tuple[str, ...]) -> str:
    """Return what ``mapquilt WORDS --help`` prints on a terminal of 100 columns."""
    os.environ["COLUMNS"] = os.environ["TERMINAL_WIDTH"] = "100"
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        run([*words, "--help"])
    return printed.getvalue()
