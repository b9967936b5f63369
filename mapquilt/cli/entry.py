"""Run one command, and report errors in one line."""

from __future__ import annotations

import re
import traceback

import typer

from mapquilt.cli.exit_status import BAD_INPUT, INTERNAL_ERROR, INTERRUPTED, TERMINATED, UNFINISHED, Termination
from mapquilt.jobs.runner import UnfinishedError

_OF_A_FIELD = re.compile(r"(?:[\w ]+: )?([a-z_]+) is (\S+(?: [A-Za-z]+)?), (must .+)")
"""Pattern of the message about a field that is out of range."""


def run_app(app: typer.Typer, arguments: list[str], name: str) -> int:
    """Run one command of an application and return its exit status. Errors end here, in one line on standard error."""
    status, message = _outcome(app, arguments, name)
    if message is not None:
        typer.echo(f"{name}: {_printable(' '.join(message.split()))}", err=True)
    return status


def _outcome(app: typer.Typer, arguments: list[str], name: str) -> tuple[int, str | None]:
    try:
        _check_names(arguments)
        status = int(typer.main.get_command(app).main(arguments, prog_name=name, standalone_mode=False) or 0)
    except typer.TyperException as error:
        return BAD_INPUT, _with_value(error) or f"no command given; `{name} --help` lists them"
    except UnfinishedError as error:
        return UNFINISHED, str(error)
    except (ValueError, OSError, ImportError) as error:
        return BAD_INPUT, _by_option(_one_line(error), arguments)
    except MemoryError as error:
        return BAD_INPUT, f"not enough memory for this: {error}"
    except (KeyboardInterrupt, typer.Abort):
        return INTERRUPTED, "interrupted"
    except Termination:
        return TERMINATED, "terminated"
    except Exception as error:
        cause = _cause(error)
        if isinstance(cause, KeyboardInterrupt):
            return INTERRUPTED, "interrupted"
        if isinstance(cause, Termination):
            return TERMINATED, "terminated"
        traceback.print_exc()
        return INTERNAL_ERROR, f"internal error: {type(error).__name__}: {error}"
    return status, "interrupted" if status == INTERRUPTED else None


def _cause(error: BaseException) -> BaseException:
    """Return the cause of an error, such as an interrupt that arrives while numba converts the arguments of a call.

    CPython reports it as a ``SystemError``, once for each call that returns through compiled code.
    """
    while isinstance(error, SystemError) and error.__cause__ is not None:
        error = error.__cause__
    return error


def _check_names(arguments: list[str]) -> None:
    """Refuse file names that are not UTF-8 or steer a terminal, because records and tables contain them."""
    for argument in arguments:
        name = argument.encode(errors="backslashreplace").decode()
        if name != argument:
            raise ValueError(f"{name}: is not UTF-8, which names must be")
        if _printable(argument) != argument:
            raise ValueError(f"{_printable(argument)}: has a control character, which names must not have")


def _printable(text: str) -> str:
    """Escape control characters, as ``safe_load.printable`` does."""
    if text.isprintable():
        return text
    from mapping.io.safe_load import printable  # here: it loads numba, which the help does not need

    return printable(text)


def _with_value(error: typer.TyperException) -> str:
    """Return the message about invalid arguments, with the value."""
    from pydantic import ValidationError  # here: only errors need it, and it takes long to load

    message = error.format_message()
    if isinstance(error.__cause__, ValidationError):
        value = error.__cause__.errors()[0]["input"]
        return message.replace("Input should", f"{str(value)[:100]!r} should", 1)
    return message


def _one_line(error: ValueError | OSError | ImportError) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return str(error)


def _by_option(message: str, arguments: list[str]) -> str:
    """Name the option in a message about a field, if the option was given."""
    found = _OF_A_FIELD.fullmatch(message)
    if found is None:
        return message
    field, value, rule = found.groups()
    option = f"--{field.replace('_', '-')}"
    given = any(argument.partition("=")[0] == option for argument in arguments)
    return f"{option} {value}: {rule}" if given else message
