"""Applications of the command line: plain help, whole descriptions, no completion."""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperGroup


class WholeHelpGroup(TyperGroup):
    """List the commands with their whole first sentence, folded rather than cut."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        commands = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        rows = [(name, each.get_short_help_str(limit=1000)) for name, each in commands if each is not None]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


def new_app(cls: type[TyperGroup] = WholeHelpGroup, **attributes: Any) -> typer.Typer:
    """Start an application with plain help and no completion."""
    return typer.Typer(
        cls=cls,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        no_args_is_help=False,
        **attributes,
    )
