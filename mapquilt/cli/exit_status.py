"""Exit statuses of the command."""

ALL_MERGED, SOME_REFUSED, BAD_INPUT, NOT_REACHED, INTERNAL_ERROR = 0, 1, 2, 3, 70
"""NOT_REACHED: what was asked for, such as an overlap, cannot be reached; the nearest result is written."""

UNFINISHED = 75
"""The machine failed a part of the work, by dead workers or too little memory, and the same command continues;
EX_TEMPFAIL of sysexits.h."""

INTERRUPTED, CLOSED_PIPE, TERMINATED = 130, 141, 143
"""128 plus the number of the signal, as in shells."""


class Termination(SystemExit):
    """Raised by SIGTERM, so that the command ends as after an interrupt."""
