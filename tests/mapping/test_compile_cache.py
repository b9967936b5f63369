"""Whether a function has been compiled."""

from __future__ import annotations

import numba

from mapping.compile_cache import is_compiled


def _added(a, b):
    return a + b


def test_a_function_is_compiled_after_its_first_call_and_for_later_processes(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    function = numba.njit(cache=True)(_added)
    assert not is_compiled(function)
    assert function(1, 2) == 3
    assert is_compiled(function)
    assert is_compiled(numba.njit(cache=True)(_added))  # another process finds it on disk
