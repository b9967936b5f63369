"""Export of a data set to Parquet or tar files, with a card and a description."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Collection, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

from mapping.io.transaction import atomic_folder
from mapping.wording import did_you_mean
from mapquilt.benchmark.exchange.identity import by_identity, data_digest
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.pair_sets import dataset_pairs
from mapquilt.benchmark.publication.card import (
    CARD_FILE,
    EVALUATION_FILE,
    Card,
    SplitCard,
    card_text,
    evaluation_text,
)
from mapquilt.benchmark.publication.croissant import CROISSANT_FILE, croissant_record
from mapquilt.benchmark.publication.parquet import write_parquet
from mapquilt.benchmark.publication.rows import Row, rows
from mapquilt.benchmark.publication.shards import write_shard
from mapquilt.dataset.manifest import Manifest, read_manifest, require_split
from mapquilt.dataset.spec import LICENCE, SPLITS
from mapquilt.jobs.runner import Progress, no_progress
from mapquilt.json_file import to_text, write_record

SCHEMA = "mapquilt-shards/1"
SHARDS_FILE, DATA_FOLDER = "shards.json", "data"
PARQUET, WEBDATASET, CROISSANT = "parquet", "webdataset", "croissant"

WRITERS: dict[str, tuple[str, Callable[[Path, Iterator[Row]], None]]] = {
    PARQUET: (".parquet", write_parquet),
    WEBDATASET: (".tar", write_shard),
    CROISSANT: (".parquet", write_parquet),
}
"""Ending and writer of the files of each format; Croissant describes Parquet files, one for each split."""


def require_format(name: str) -> None:
    """Raise ``ValueError`` naming the formats if there is no such one."""
    if name not in WRITERS:
        raise ValueError(f"--format {name}: must be one of {', '.join(WRITERS)}{did_you_mean(name, WRITERS)}")


def export_dataset(
    folder: Path,
    out: Path,
    layout: str,
    *,
    withheld: Collection[str] = (),
    pairs_per_file: int = 2000,
    on_progress: Progress = no_progress,
) -> dict[str, int]:
    """Write all pairs of a data set, all or nothing; an export there is replaced. Return the pairs of each split.

    ``layout`` is a key of ``WRITERS``; ``withheld`` are the splits whose truth is left out. Pairs are in the order of
    their names, which tell nothing of the truth. A file holds at most ``pairs_per_file``, or a whole split for
    Croissant; few are in memory at a time.

    Raises ``ValueError`` if the folder is no data set, lacks a split or has no pairs, or a map is not as it was made,
    and ``ImportError`` if a package is missing.
    """
    manifest = read_manifest(folder)
    for split in withheld:
        require_split(folder, manifest, split)
    made = {str(sample["split"]) for sample in manifest.samples}
    pairs = {split: by_identity(found) for split in SPLITS if split in made and (found := dataset_pairs(folder, split))}
    if not pairs:
        raise ValueError(f"{folder}: has no pair of maps")
    total, done = sum(map(len, pairs.values())), 0
    splits: list[dict[str, Any]] = []
    with atomic_folder(out, ledger=True) as aside:
        (aside / DATA_FOLDER).mkdir()
        for split, named in pairs.items():
            size = len(named) if layout == CROISSANT else pairs_per_file
            files = {}
            for path, part in _parts(named, split, WRITERS[layout][0], size):
                WRITERS[layout][1](aside / path, rows(part, withheld=split in withheld))
                files[path] = _sha256(aside / path)
                done += len(part)
                on_progress(done, total)
            splits.append(_split_record(split, named, files, truth=split not in withheld))
        _describe(aside, manifest, layout, splits)
    return {split: len(named) for split, named in pairs.items()}


def _parts(
    pairs: Mapping[str, BenchmarkPair], split: str, ending: str, size: int
) -> Iterator[tuple[str, dict[str, BenchmarkPair]]]:
    """Divide the pairs of a split among files."""
    count, remaining = math.ceil(len(pairs) / size), iter(pairs.items())
    for number in range(count):
        yield f"{DATA_FOLDER}/{split}-{number:05d}-of-{count:05d}{ending}", dict(islice(remaining, size))


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _split_record(
    split: str, pairs: Mapping[str, BenchmarkPair], files: dict[str, str], *, truth: bool
) -> dict[str, Any]:
    return {
        "split": split,
        "pairs": len(pairs),
        "digest": data_digest(list(pairs.values())),
        "truth": truth,
        "files": [{"file": path, "sha256": digest} for path, digest in files.items()],
    }


def _describe(out: Path, manifest: Manifest, layout: str, splits: list[dict[str, Any]]) -> None:
    """Write the card, eval.yaml, shards.json and, for Croissant, its description."""
    name, generator = str(manifest.header["name"]), str(manifest.header["generator"])
    pairs = sum(split["pairs"] for split in splits)
    card = Card(
        name=name,
        about=f"{pairs} pairs of occupancy grids of robots that started at unknown poses in simulated worlds, with the "
        "true similarity transform between them, to compare methods of map merging.",
        licences=tuple(sorted({str(mission.get("licence", LICENCE)) for mission in manifest.missions})),
        generator=generator,
        layout=layout,
        ending=WRITERS[layout][0],
    )
    cards = [SplitCard(split["split"], split["pairs"], split["digest"], split["truth"]) for split in splits]
    (out / CARD_FILE).write_text(card_text(card, cards), encoding="utf-8")
    (out / EVALUATION_FILE).write_text(evaluation_text(card, cards), encoding="utf-8")
    record = {"schema": SCHEMA, "name": name, "format": layout, "splits": splits}
    write_record(out / SHARDS_FILE, "shards", record)
    if layout == CROISSANT:
        files = {split["split"]: (split["files"][0]["file"], split["files"][0]["sha256"]) for split in splits}
        described = croissant_record(card.name, card.about, card.licences, generator.split()[-1], files)
        (out / CROISSANT_FILE).write_text(to_text(described), encoding="utf-8")
