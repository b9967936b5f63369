"""The folder in which numba caches compiled functions."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numba


def ensure_compile_cache() -> None:
    """Give numba a temporary cache folder if it can write to none of its usual ones.

    Otherwise numba refuses to define a cached function. The folder is deleted at the end of the process.
    Raises ``FileNotFoundError`` if not even a temporary folder can be made.
    """
    try:
        numba.njit(cache=True)(_probe)
    except RuntimeError:
        folder = tempfile.mkdtemp(prefix="mapquilt-")
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        numba.config.CACHE_DIR = folder  # type: ignore[attr-defined]


def is_compiled(function: Any) -> bool:
    """Return whether numba has a compiled version of a cached function on disk or in memory."""
    folder, module = Path(function.stats.cache_path), function.__module__.rpartition(".")[2]
    return bool(function.signatures) or any(folder.glob(f"{module}.{function.__name__}-*.nbi"))


def _probe() -> None:
    """Stand for any cached function; it is never called, so never compiled."""
