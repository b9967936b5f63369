"""Whether a function has been compiled."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from mapping.compile_cache import is_compiled, user_cache_folder


def _added(a, b):
    return a + b


def test_a_function_is_compiled_after_its_first_call_and_for_later_processes(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    function = numba.njit(cache=True)(_added)
    assert not is_compiled(function)
    assert function(1, 2) == 3
    assert is_compiled(function)
    assert is_compiled(numba.njit(cache=True)(_added))  # another process finds it on disk


@pytest.mark.parametrize(
    ("platform", "environment", "folder"),
    [
        ("linux", {}, "/home/ada/.cache/mapquilt/numba"),
        ("linux", {"XDG_CACHE_HOME": "/scratch"}, "/scratch/mapquilt/numba"),
        ("darwin", {}, "/home/ada/Library/Caches/mapquilt/numba"),
        ("win32", {"LOCALAPPDATA": "/local"}, "/local/mapquilt/numba"),
    ],
)
def test_the_cache_is_where_the_platform_keeps_them(platform, environment, folder):
    assert user_cache_folder(platform, environment, Path("/home/ada")) == Path(folder)


@pytest.mark.slow
def test_no_compiled_file_lies_beside_the_sources(tmp_path):
    """Uninstalling deletes the sources alone, so that whatever lies beside them would stay and could be imported."""
    code = (
        "import numba, mapping, mapping.ground_truth.wall_agreement as module\n"
        "functions = [each for each in vars(module).values() if isinstance(each, numba.core.registry.CPUDispatcher)]\n"
        "print(*{each.stats.cache_path for each in functions}, sep='\\n')"
    )
    environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    environment["XDG_CACHE_HOME"] = str(tmp_path)
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    folders = done.stdout.split()
    assert folders
    assert all(Path(folder).is_relative_to(tmp_path / "mapquilt") for folder in folders)
