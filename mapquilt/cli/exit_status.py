"""Exit statuses of the command."""

ALL_MERGED, SOME_REFUSED, BAD_INPUT, INTERNAL_ERROR = 0, 1, 2, 70

INTERRUPTED, CLOSED_PIPE = 130, 141
"""128 plus the number of the signal, as in shells."""
