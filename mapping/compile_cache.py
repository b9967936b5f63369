"""Where numba keeps what it compiled."""

from __future__ import annotations

import atexit
import shutil
import tempfile

import numba


def ensure_compile_cache() -> None:
    """Let numba compile where it may keep nothing: an installation, a home and a NUMBA_CACHE_DIR that are read-only.

    It refuses to define a function whose code it is to keep and cannot. Then it is given a folder that goes away with
    the process. Raises ``FileNotFoundError`` where not even a temporary folder can be made.
    """
    try:
        numba.njit(cache=True)(_probe)
    except RuntimeError:
        folder = tempfile.mkdtemp(prefix="mapquilt-")
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        numba.config.CACHE_DIR = folder  # type: ignore[attr-defined]


def _probe() -> None:
    """What is never called, and so never compiled."""
