"""Protection of input maps against being overwritten."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mapping.io.map_yaml import image_path, read_map_yaml


def spare_maps(out: Path, sources: Sequence[Path], written: Sequence[Path]) -> None:
    """Raise ``ValueError`` naming ``out`` if a file to be written belongs to one of the input maps ``sources``."""
    read = [file for source in sources for file in _files(source)]
    for path in written:
        if any(path.exists() and path.samefile(each) for each in read):
            raise ValueError(f"{out}: would overwrite the input {path}; choose another name")


def _files(source: Path) -> list[Path]:
    if source.suffix.lower() in (".yaml", ".yml"):
        return [source, image_path(source, read_map_yaml(source)[0])]
    return [source]
