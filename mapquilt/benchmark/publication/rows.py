"""Rows of an exported data set: one for each pair, with both maps as pictures and the truth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from mapping.grid.frame import GridFrame
from mapping.io.map_file import load_map, map_files, require_known
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.pair_list import pair_entry
from mapquilt.dataset.loader import check_files

Kind = Literal["text", "number", "flag", "picture"]
Row = dict[str, Any]
"""Values by the name of the column; a picture is the bytes of a PNG. None: withheld, or there is none."""

MAPS_IN_MEMORY = 1024
"""Pictures that are kept, about 20 MB: a map is in several pairs."""


@dataclass(frozen=True)
class Column:
    """Describe a column; those of the ``truth`` are None where it is withheld."""

    name: str
    kind: Kind
    about: str
    truth: bool = True


GREYS = "PNG, 0 occupied, 254 free, 205 unknown"

COLUMNS = (
    Column("pair", "text", "name of the pair, that of `mapquilt benchmark export`", truth=False),
    Column("target", "picture", f"map of one robot: {GREYS}", truth=False),
    Column("source", "picture", f"map of another robot: {GREYS}", truth=False),
    Column("target_resolution", "number", "size of a pixel that the target states [m]", truth=False),
    Column("source_resolution", "number", "size of a pixel that the source states [m]", truth=False),
    Column("resolutions_trusted", "flag", "false if the stated sizes may be wrong by a factor", truth=False),
    Column("kind", "text", "positive, or negative if the pair must be refused"),
    Column("scale", "number", "true transform from pixels of the source to pixels of the target: scale"),
    Column("rotation_deg", "number", "its rotation from x right to y down [degrees]"),
    Column("tx", "number", "its translation along x, right, centres of pixels at integers [pixels]"),
    Column("ty", "number", "its translation along y, down [pixels]"),
    Column("overlap", "number", "share of the smaller footprint that both robots observed"),
    Column("identifiable", "flag", "false if several placements are right, so that a refusal is too"),
    Column("residual_m", "number", "RMS residual of the true transform [m]; none if there is no fit"),
    Column("target_scale", "number", "true metres per metre that the target states"),
    Column("subset", "text", "reason why a negative pair must be refused"),
    Column("world", "text", "family of worlds; none if the two maps differ in it"),
    Column("mission", "text", "mission; those of two are joined by +"),
    Column("geometry", "text", "hash of the world; those of two are joined by +"),
    Column("noise", "number", "noise level; none if the two maps differ in it"),
    Column("poses", "text", "poses that the robots mapped with; none if the two maps differ in them"),
    Column("name", "text", "name of the pair in the data set"),
)


def rows(pairs: Mapping[str, BenchmarkPair], *, withheld: bool) -> Iterator[Row]:
    """Read the maps of each pair of a data set and yield its row, in the order of ``pairs``.

    Raises ``ValueError`` or ``OSError`` naming a map file that cannot be used, or is not as it was made.
    """
    picture = lru_cache(MAPS_IN_MEMORY)(_picture)
    for name, pair in pairs.items():
        check_files(pair.digests)
        (target, target_png), (source, source_png) = picture(pair.target_file), picture(pair.source_file)
        given = {
            "pair": name,
            "target": target_png,
            "source": source_png,
            "target_resolution": target.resolution,
            "source_resolution": source.resolution,
            "resolutions_trusted": pair.resolutions_trusted,
        }
        true = pair_entry(pair.info, pair.truth, frames=(target, source), resolutions_trusted=pair.resolutions_trusted)
        yield given | {column.name: None if withheld else true.get(column.name) for column in COLUMNS if column.truth}


def _picture(file: Path) -> tuple[GridFrame, bytes]:
    """Read a map, and return its frame and its cells as a PNG."""
    grid = require_known(load_map(file)).grid
    (png,) = (data for path, data in map_files(grid, Path("map"), picture="png").items() if path.suffix == ".png")
    return grid.frame, png
