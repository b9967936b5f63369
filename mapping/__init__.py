"""What a map is, and how scans become one: the nouns that every room speaks."""

from mapping.compile_cache import ensure_compile_cache

ensure_compile_cache()
