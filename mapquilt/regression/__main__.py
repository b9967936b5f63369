"""``python -m mapquilt.regression``."""

from __future__ import annotations

import sys

import typer

from mapquilt.exit_status import BAD_INPUT
from mapquilt.regression.command import regression


def main() -> int:
    """Compare, or update, and give the exit status; what is wrong is one line on standard error."""
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
    app.command()(regression)
    try:
        return int(typer.main.get_command(app).main(prog_name="mapquilt.regression", standalone_mode=False) or 0)
    except typer.TyperException as error:
        sys.stderr.write(f"mapquilt.regression: {error.format_message()}\n")
    except (ValueError, OSError) as error:
        sys.stderr.write(f"mapquilt.regression: {error}\n")
    return BAD_INPUT


if __name__ == "__main__":
    sys.exit(main())
