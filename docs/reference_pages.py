"""MkDocs hook: write the command-line reference from the commands themselves."""

from __future__ import annotations

import contextlib
import io
import os
from typing import Any

from mapquilt.cli.app import VERBS, load_verb, run

PAGE = "reference/cli.md"


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Append the help of every verb to the page on the command line."""
    return markdown + "".join(map(_section, _commands())) if page.file.src_uri == PAGE else markdown


def _commands() -> list[tuple[str, ...]]:
    commands: list[tuple[str, ...]] = []
    for name in VERBS:
        inner = getattr(load_verb(name), "commands", {})
        commands += [(name, sub) for sub in inner] or [(name,)]
    return commands


def _section(words: tuple[str, ...]) -> str:
    return f"\n## mapquilt {' '.join(words)}\n\n```text\n{help_of(words)}```\n"


def help_of(words: tuple[str, ...]) -> str:
    """Return what ``mapquilt WORDS --help`` prints on a terminal of 100 columns."""
    os.environ["COLUMNS"] = os.environ["TERMINAL_WIDTH"] = "100"
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        run([*words, "--help"])
    return printed.getvalue()
