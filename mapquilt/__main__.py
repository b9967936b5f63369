"""Run the command: ``mapquilt``, or ``python -m mapquilt``. This module loads fast, so that an interrupt during the
import of the rest is handled."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType

from mapquilt.cli.exit_status import BAD_INPUT, CLOSED_PIPE, INTERRUPTED, TERMINATED, Termination

LEAST_ADDRESSES = 2**31
"""Least address space [bytes]: the libraries alone map 1 GB of it."""

ADDRESSES_PER_CORE = 2**26
"""Address space that the two copies of OpenBLAS, of NumPy and SciPy, reserve for each core [bytes]."""


def main() -> None:
    """Run the command line and exit with its status."""
    problem = _problem()
    if problem is not None:
        sys.exit(_fail(problem, BAD_INPUT))
    signal.signal(signal.SIGTERM, _terminate)
    _fill_descriptors()
    if sys.stdout is None:
        sys.exit(_fail("standard output: is closed; redirect it to /dev/null to discard it", BAD_INPUT))
    try:
        from mapquilt.cli.app import run
        from mapquilt.cli.standard_output import named

        sys.stdout = named(sys.stdout)
        status = run(sys.argv[1:])
    except Termination:
        status = _fail("terminated", TERMINATED)
    except KeyboardInterrupt:
        status = _fail("interrupted", INTERRUPTED)
    except OSError as error:
        status = _fail(str(error), BAD_INPUT)
    except SystemExit:  # what prints tables leaves so where nobody reads standard output any more
        status = CLOSED_PIPE
    if status in (INTERRUPTED, TERMINATED):
        exec("")  # if the interrupt ended generated code, such as a dataclass's, CPython would not heed our exit status
    sys.exit(_flushed(status))


def _problem() -> str | None:
    """Return why this system cannot run the program, None if it can. OpenBLAS waits for ever if it gets no memory."""
    if os.name != "posix":
        return "needs a POSIX system (Linux, macOS, or WSL on Windows), whose file locks it uses"
    from resource import RLIM_INFINITY, RLIMIT_AS, getrlimit

    limit, least = getrlimit(RLIMIT_AS)[0], LEAST_ADDRESSES + (os.cpu_count() or 1) * ADDRESSES_PER_CORE
    if limit == RLIM_INFINITY or limit >= least:
        return None
    return f"ulimit -v is {limit // 1024} kB, must be at least {least // 1024} kB"


def _terminate(number: int, frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # a second one ends the command at once
    raise Termination


def _fill_descriptors() -> None:
    """Open closed standard streams on the null device, so that no file gets their number and what is printed."""
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(descriptor, True)
    os.close(descriptor)


def _fail(message: str, status: int) -> int:
    if sys.stderr is not None:
        sys.stderr.write(f"mapquilt: {message}\n")
    return status


def _flushed(status: int) -> int:
    """Flush standard output and return the exit status. On an error, discard the rest of the output, so that the
    interpreter does not try again, and report the error once."""
    try:
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):
            return CLOSED_PIPE
        return status if status == BAD_INPUT else _fail(f"standard output: {error.strerror}", BAD_INPUT)
    return status


if __name__ == "__main__":
    main()
