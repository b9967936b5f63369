"""Folder of a benchmark for other programs: all maps, and a list of pairs without their truth."""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from mapping.io.map_file import load_map, map_files, require_known
from mapping.io.transaction import atomic_folder
from mapquilt.benchmark.exchange.identity import data_digest
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.dataset.loader import check_files
from mapquilt.jobs.runner import Progress, no_progress
from mapquilt.json_file import write_record

SCHEMA = "mapquilt-export/1"
EXPORT_FILE, MAPS_FOLDER = "export.json", "maps"


def write_export(out: Path, pairs: Mapping[str, BenchmarkPair], on_progress: Progress = no_progress) -> int:
    """Write the maps of all pairs and ``export.json``, all or nothing; an export there is replaced.

    ``pairs`` are named by ``by_identity``. A map of several pairs is written once, under a hash of its files. Returns
    the number of maps. Raises ``ValueError`` or ``OSError`` naming a map file that cannot be used.
    """
    with atomic_folder(out, ledger=True) as folder:
        (folder / MAPS_FOLDER).mkdir()
        entries: list[dict[str, Any]] = []
        written: dict[Path, str] = {}
        for done, (name, pair) in enumerate(pairs.items(), start=1):
            check_files(pair.digests)
            for file in (pair.target_file, pair.source_file):
                if file not in written:
                    written[file] = _write_map(folder, file)
            entries.append(
                {
                    "pair": name,
                    "target": written[pair.target_file],
                    "source": written[pair.source_file],
                    "resolutions_trusted": pair.resolutions_trusted,
                }
            )
            on_progress(done, len(pairs))
        record = {"schema": SCHEMA, "digest": data_digest(list(pairs.values())), "pairs": entries}
        write_record(folder / EXPORT_FILE, "export", record)
    return len(set(written.values()))


def _write_map(folder: Path, file: Path) -> str:
    """Write a map as PNG and YAML under a hash of both, and return the name of the YAML."""
    grid = require_known(load_map(file)).grid
    stem = Path("map")
    name = sha256(b"".join(map_files(grid, stem, picture="png").values())).hexdigest()[:16]
    for path, content in map_files(grid, folder / MAPS_FOLDER / name, picture="png").items():
        path.write_bytes(content)
    return f"{MAPS_FOLDER}/{name}.yaml"
