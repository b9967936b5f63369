"""Loader of data sets: samples and pairs with typed fields, loaded on access."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import load_map
from mapping.map_set import MapSet
from mapping.robot.robot_log import RobotLog
from mapping.wording import counted
from mapquilt.dataset.manifest import SAMPLES_FOLDER, Manifest, read_manifest, require_split
from mapquilt.dataset.seal import file_problem
from mapquilt.json_file import similarity_from_record
from mapquilt.runs import folder as run_folder
from mapquilt.runs.truth_file import RunTruth, load_truth

CACHED_MAPS = 64
"""Maps whose paths and hashes a data set keeps: those of the largest teams of robots."""


@dataclass(frozen=True)
class DatasetSample:
    """Hold one sample: ``record`` is its line in the manifest, ``folder`` its path; files are read on access."""

    folder: Path
    record: dict[str, Any]

    @property
    def name(self) -> str:
        return str(self.record["sample"])

    @property
    def split(self) -> str:
        return str(self.record["split"])

    def maps(self) -> MapSet:
        """Load the maps. Raises ``ValueError`` if a file is not as it was made."""
        check_files(self.digests(run_folder.MAPS_FILE, *(f"{one['name']}/" for one in self.record["maps"])))
        return run_folder.load_maps(self.folder)

    def truth(self) -> RunTruth:
        """Load the true transforms. Raises ``ValueError`` if the file is not as it was made."""
        check_files(self.digests(run_folder.TRUTH_FILE))
        return load_truth(self.folder / run_folder.TRUTH_FILE)

    def log(self, name: str) -> RobotLog:
        """Load the log of a map's robot. Raises ``ValueError`` if the file is not as it was made."""
        check_files(self.digests(f"{name}/"))
        return run_folder.load_log(self.folder, name)

    def digests(self, *prefixes: str) -> dict[Path, str]:
        """Return the hash of each file of the sample, or of those whose path begins with one of ``prefixes``."""
        files = self.record["files"]
        return {self.folder / path: files[path] for path in files if path.startswith(prefixes or "")}


def check_files(digests: Mapping[Path, str]) -> None:
    """Raise ``ValueError`` naming the first file that is not as it was made."""
    for path, digest in digests.items():
        problem = file_problem(path, digest)
        if problem is not None:
            raise ValueError(f"{path}: {problem} since the data set was made")


@dataclass(frozen=True)
class DatasetPair:
    """Hold two maps of different robots. ``target_from_source`` is None if they show two worlds and must be refused.

    ``noise``, ``world`` (the family) and ``poses`` (those that the robots mapped with) are None if the two maps differ
    in them. ``geometry`` is the hash of the mission's world, those of two joined by a plus, None in older data sets.
    ``residual`` is that of the fitted true transform [m], None if it was not fitted; ``target_scale`` is true
    metres per metre that the target states.
    """

    name: str
    mission: str
    geometry: str | None
    split: str
    world: str | None
    noise: float | None
    poses: str | None
    target_path: Path
    source_path: Path
    target_from_source: Similarity2 | None
    overlap: float
    identifiable: bool
    residual: float | None
    target_scale: float
    resolutions_trusted: bool
    digests: Mapping[Path, str] = field(repr=False)

    @cached_property
    def target(self) -> OccupancyGrid:
        """Load the target. Raises ``ValueError`` if a file of it is not as it was made."""
        return self._load(self.target_path)

    @cached_property
    def source(self) -> OccupancyGrid:
        """Load the source. Raises as ``target``."""
        return self._load(self.source_path)

    def _load(self, path: Path) -> OccupancyGrid:
        check_files({file: digest for file, digest in self.digests.items() if file.parent == path.parent})
        return load_map(path).grid

    def map_set(self) -> MapSet:
        """Return the pair as a map set for the merger, with maps named target and source."""
        grids = (self.target, self.source)
        return MapSet(("target", "source"), grids, ("m", "m"), resolutions_trusted=self.resolutions_trusted)


class _Lazy(Sequence[Any]):
    """A sequence whose items are built on access."""

    def __init__(self, records: Sequence[Any], make: Any) -> None:
        self._records = records
        self._make = make

    def __len__(self) -> int:
        return len(self._records)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return _Lazy(self._records[index], self._make)
        return self._make(self._records[index])


class Dataset:
    """A finished data set, or one split of it. ``samples`` and ``pairs`` are sequences that read files on access."""

    def __init__(self, folder: Path, manifest: Manifest, split: str | None) -> None:
        self.folder = folder
        self._samples = [record for record in manifest.samples if split in (None, record["split"])]
        # Pairs of one sample follow one another, and share the paths and hashes of its maps.
        self._map_files = lru_cache(CACHED_MAPS)(self._read_map_files)
        self._by_name = {record["sample"]: record for record in manifest.samples}
        self._geometry: dict[str, str | None] = {one["mission"]: one.get("fingerprint") for one in manifest.missions}
        negatives = [record for record in manifest.negatives if split in (None, record["split"])]
        self._pairs = [*self._within_samples(), *((None, record) for record in negatives)]

    def _within_samples(self) -> Iterator[tuple[dict[str, Any] | None, dict[str, Any]]]:
        for sample in self._samples:
            for pair in sample["pairs"]:
                yield sample, pair

    @property
    def samples(self) -> Sequence[DatasetSample]:
        return _Lazy(self._samples, self._sample)

    @property
    def pairs(self) -> Sequence[DatasetPair]:
        return _Lazy(self._pairs, self._pair)

    def _sample(self, record: dict[str, Any]) -> DatasetSample:
        return DatasetSample(self.folder / SAMPLES_FOLDER / record["sample"], record)

    def _pair(self, entry: tuple[dict[str, Any] | None, dict[str, Any]]) -> DatasetPair:
        sample, record = entry
        if sample is None:
            return self._two_worlds(record)
        (target_path, target_digests), (source_path, source_digests) = (
            self._map_files(sample["sample"], record[end]) for end in ("target", "source")
        )
        return DatasetPair(
            name=f"{sample['sample']}/{record['target']}/{record['source']}",
            mission=sample["mission"],
            geometry=self._geometry.get(sample["mission"]),
            split=sample["split"],
            world=sample["world"],
            noise=sample["settings"]["noise"],
            poses=sample["settings"]["poses"],
            target_path=target_path,
            source_path=source_path,
            target_from_source=similarity_from_record(record["target_from_source"]),
            overlap=record["overlap"],
            identifiable=record["identifiable"],
            residual=record["residual_m"],
            target_scale=_true_scale(sample, record["target"]),
            resolutions_trusted=_trusted(sample),
            digests=target_digests | source_digests,
        )

    def _read_map_files(self, sample: str, name: str) -> tuple[Path, dict[Path, str]]:
        """Return the path of a map, and the hashes of its files."""
        folder, files = self.folder / SAMPLES_FOLDER / sample, self._by_name[sample]["files"]
        digests = {folder / path: digest for path, digest in files.items() if path.startswith(f"{name}/map.")}
        return folder / name / "map.yaml", digests

    def _two_worlds(self, record: dict[str, Any]) -> DatasetPair:
        ends = [record["target"], record["source"]]
        samples = [self._by_name[end["sample"]] for end in ends]
        worlds = [self._geometry.get(sample["mission"]) for sample in samples]
        (target_path, target_digests), (source_path, source_digests) = (
            self._map_files(end["sample"], end["map"]) for end in ends
        )
        return DatasetPair(
            name="/".join(f"{end['sample']}/{end['map']}" for end in ends),
            mission="+".join(sample["mission"] for sample in samples),
            geometry=None if None in worlds else "+".join(map(str, worlds)),
            split=record["split"],
            world=_common(sample["world"] for sample in samples),
            noise=_common(sample["settings"]["noise"] for sample in samples),
            poses=_common(sample["settings"]["poses"] for sample in samples),
            target_path=target_path,
            source_path=source_path,
            target_from_source=None,
            overlap=0.0,
            identifiable=False,
            residual=None,
            target_scale=_true_scale(samples[0], ends[0]["map"]),
            resolutions_trusted=all(_trusted(sample) for sample in samples),
            digests=target_digests | source_digests,
        )


def _true_scale(sample: dict[str, Any], name: str) -> float:
    return float(next(one["world_from_map"]["scale"] for one in sample["maps"] if one["name"] == name))


def _common(values: Iterable[Any]) -> Any:
    different = set(values)
    return different.pop() if len(different) == 1 else None


def _trusted(sample: dict[str, Any]) -> bool:
    ranges = sample["settings"]["frame_perturbation"]
    return bool(ranges["scale_low"] == ranges["scale_high"] == 1.0)


def load_dataset(folder: str | Path, split: str | None = None, *, verify: bool = False) -> Dataset:
    """Open a finished data set, or one split of it.

    The manifest is checked against its seal, and each file of a sample when it is read; ``verify`` checks all files
    now, as ``mapquilt dataset verify`` does.

    Raises ``ValueError`` if the folder is not a data set, is not as it was made, or lacks the split; the message lists
    its splits.
    """
    manifest = read_manifest(Path(folder))
    if verify:
        from mapquilt.dataset.verify import verify_dataset  # here: it needs the simulator, which reading does not

        problems = verify_dataset(Path(folder))
        if problems:
            raise ValueError(
                f"{folder}: {problems[0]}; mapquilt dataset verify {folder} lists {counted(len(problems), 'problem')}"
            )
    if split is not None:
        require_split(Path(folder), manifest, split)
    return Dataset(Path(folder), manifest, split)
