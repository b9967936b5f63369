"""Maps and how scans become maps: the types that all other packages use."""

from mapping.compile_cache import ensure_compile_cache

ensure_compile_cache()
