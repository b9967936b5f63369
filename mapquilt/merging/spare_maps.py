"""Maps that are read are never written over."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mapping.io.map_yaml import image_path, read_map_yaml


def spare_maps(out: Path, sources: Sequence[Path], written: Sequence[Path]) -> None:
    """Raise ``ValueError`` naming ``out`` where one of the files to be written for it belongs to a map that is read."""
    read = [file for source in sources for file in _files(source)]
    for path in written:
        if any(path.exists() and path.samefile(each) for each in read):
            raise ValueError(f"{out}: would replace {path}, which is read; write elsewhere")


def _files(source: Path) -> list[Path]:
    if source.suffix.lower() in (".yaml", ".yml"):
        return [source, image_path(source, read_map_yaml(source)[0])]
    return [source]
