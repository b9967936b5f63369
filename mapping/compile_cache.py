"""The folder in which numba caches compiled functions."""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numba


def ensure_compile_cache() -> None:
    """Let numba cache in the user's cache folder, unless ``NUMBA_CACHE_DIR`` names another one.

    By default it caches beside the sources, where uninstalling leaves its files, and the folders that hold them can be
    imported. If the folder cannot be written, a temporary one is used, and deleted at the end of the process; without
    any, numba refuses to define a cached function. Raises ``FileNotFoundError`` if not even that can be made.
    """
    try:
        if not numba.config.CACHE_DIR:  # type: ignore[attr-defined]
            folder = user_cache_folder(sys.platform, os.environ, Path.home())
            numba.config.CACHE_DIR = str(folder)  # type: ignore[attr-defined]
        numba.njit(cache=True)(_probe)
    except (RuntimeError, OSError):
        temporary = tempfile.mkdtemp(prefix="mapquilt-")
        atexit.register(shutil.rmtree, temporary, ignore_errors=True)
        numba.config.CACHE_DIR = temporary  # type: ignore[attr-defined]


def user_cache_folder(platform: str, environment: Mapping[str, str], home: Path) -> Path:
    """Return the folder for compiled functions by the custom of the platform."""
    if platform == "win32":
        base = Path(environment.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(environment.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "mapquilt" / "numba"


def is_compiled(function: Any) -> bool:
    """Return whether numba has a compiled version of a cached function on disk or in memory."""
    folder, module = Path(function.stats.cache_path), function.__module__.rpartition(".")[2]
    return bool(function.signatures) or any(folder.glob(f"{module}.{function.__name__}-*.nbi"))


def _probe() -> None:
    """Stand for any cached function; it is never called, so never compiled."""
