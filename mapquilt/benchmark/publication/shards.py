"""Pairs as a tar file in the layout of WebDataset: NAME.target.png, NAME.source.png and NAME.json of each."""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Iterator
from pathlib import Path

from mapquilt.benchmark.publication.rows import COLUMNS, Row


def write_shard(path: Path, rows: Iterator[Row]) -> None:
    """Write rows to a tar file without times and owners, so that the same rows give the same bytes."""
    with tarfile.open(path, "w", format=tarfile.USTAR_FORMAT) as shard:
        for row in rows:
            values = {column.name: row[column.name] for column in COLUMNS if column.kind != "picture"}
            _add(shard, f"{row['pair']}.target.png", row["target"])
            _add(shard, f"{row['pair']}.source.png", row["source"])
            _add(shard, f"{row['pair']}.json", json.dumps(values, allow_nan=False).encode())


def _add(shard: tarfile.TarFile, name: str, content: bytes) -> None:
    member = tarfile.TarInfo(name)
    member.size = len(content)
    shard.addfile(member, io.BytesIO(content))
