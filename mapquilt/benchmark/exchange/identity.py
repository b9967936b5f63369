"""Names of pairs that tell nothing of their truth, and the digest of all pairs of a benchmark."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from hashlib import sha256
from pathlib import Path

from mapping.io.map_yaml import image_path, read_map_yaml
from mapquilt.benchmark.pair import BenchmarkPair

DIGITS = 16
"""Hexadecimal digits of a name: two of 100,000 pairs share one with a probability of 3 in 10^10."""


def pair_identities(pairs: Iterable[BenchmarkPair]) -> Iterator[str]:
    """Name each pair by a hash of its name and of both maps, whatever the folder of its set is called.

    The name of a pair in a data set shows if both maps are of one mission, this one does not. The hashes of a map's
    files are those of the manifest, or else of the files themselves, which are read once for all pairs.
    """
    read: dict[Path, str] = {}
    for pair in pairs:
        parts = [pair.info.name]
        for file in (pair.target_file, pair.source_file):
            known = sorted(digest for path, digest in pair.digests.items() if path.parent == file.parent)
            if not known and file not in read:
                read[file] = map_digest(file)
            parts.append("\n".join(known) if known else read[file])
        yield sha256("\n".join(parts).encode()).hexdigest()[:DIGITS]


def map_digest(file: Path) -> str:
    """Hash a map file and its picture. Raises ``ValueError`` or ``OSError`` naming the file that cannot be read."""
    files = [file]
    if file.suffix.lower() in (".yaml", ".yml"):
        files.append(image_path(file, read_map_yaml(file)[0]))
    return "\n".join(sha256(each.read_bytes()).hexdigest() for each in files)


def by_identity(pairs: Sequence[BenchmarkPair]) -> dict[str, BenchmarkPair]:
    """Map the name of each pair to the pair, in the order of names, which tells nothing of the truth either.

    Raises ``ValueError`` naming a pair that is there twice.
    """
    found: dict[str, BenchmarkPair] = {}
    for pair, name in zip(pairs, pair_identities(pairs), strict=True):
        if name in found:
            raise ValueError(f"{pair.info.title} is the same pair as {found[name].info.title}: name each set once")
        found[name] = pair
    return dict(sorted(found.items()))


def data_digest(pairs: Sequence[BenchmarkPair]) -> str:
    """Hash the maps and the truth of all pairs, in whatever order: equal digests, equal benchmark."""
    lines = sorted(f"{name} {pair.truth!r} {pair.resolutions_trusted}" for name, pair in by_identity(pairs).items())
    return sha256("\n".join(lines).encode()).hexdigest()
