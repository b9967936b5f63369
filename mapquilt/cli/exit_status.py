"""Exit statuses of the command."""

ALL_MERGED, SOME_REFUSED, BAD_INPUT, INTERNAL_ERROR = 0, 1, 2, 70

INTERRUPTED, CLOSED_PIPE, TERMINATED = 130, 141, 143
"""128 plus the number of the signal, as in shells."""


class Termination(SystemExit):
    """Raised by SIGTERM, so that the command ends as after an interrupt."""
