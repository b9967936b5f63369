"""merge.json: write and read the result of a merge."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mapping.arrays import frozen_array
from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapquilt.json_file import read_record, similarity_from_record, similarity_record
from mapquilt.leaves import changed_leaves
from mapquilt.merging.merge_inputs import INPUTS, MergeInputs, map_fingerprint
from mapquilt.runs import folder as run_folder
from merge.records.bend import Bend
from merge.records.bent_map import BentMap
from merge.records.evidence import Evidence
from merge.records.pair_answer import Alternative
from merge.records.result import MergedGroup, MergeResult, PairResult
from merge.records.verdict import Refusal
from merge.settings import MergeSettings

SCHEMA = "mapquilt-merge/2"


@dataclass(frozen=True)
class MergeTree:
    """Hold the settings of a merge under the name that they have in the whole tree."""

    merge: MergeSettings = field(default_factory=MergeSettings)


RECORDED_APART = ("method", "scale", "as_published", "reference", "fusion", "elastic", "acceptance.min_confidence")
"""Settings that have their own field in merge.json."""


def merge_record(inputs: MergeInputs, settings: MergeSettings, seed: int, result: MergeResult) -> dict[str, Any]:
    """Build the content of merge.json: one entry per map, per group and per unordered pair."""
    maps = inputs.maps
    return {
        "schema": SCHEMA,
        **settings_record(settings, settings.scale or maps.scale_range, seed),
        "fusion": settings.fusion,
        "elastic": settings.elastic,
        "confidence_calibrated": result.confidence_calibrated,
        "reference": result.reference,
        "reference_requested": settings.reference is not None,
        "maps": [_map_record(inputs, index, result) for index in range(len(maps))],
        "groups": [_group_record(group, index) for index, group in enumerate(result.groups)],
        "pairs": [pair_record(pair) for pair in result.pairs],
    }


def settings_record(settings: MergeSettings, scale: ScaleRange, seed: int) -> dict[str, Any]:
    """Build the record of everything that the results of pairs depend on, apart from their maps."""
    return {
        "method": settings.title,
        "scale": scale_text(scale),
        "seed": seed,
        "min_confidence": settings.acceptance.min_confidence,
        "priors": [dataclasses.asdict(prior) for prior in settings.priors],
        "settings": {
            name: value
            for name, value in changed_leaves(MergeTree(settings), MergeTree()).items()
            if name.removeprefix("merge.") not in RECORDED_APART
        },
    }


def group_stems(index: int) -> tuple[str, str]:
    """Name the merged map and the conflicts of a group, without file extensions."""
    number = f"_{index + 1}" if index else ""
    return f"{run_folder.MERGED_NAME}{number}", f"{run_folder.CONFLICTS_NAME}{number}"


def _group_record(group: MergedGroup, index: int) -> dict[str, Any]:
    merged, conflicts = group_stems(index) if has_files(group, index) else (None, None)
    return {
        "reference": group.reference,
        "merged": merged,
        "conflicts": conflicts,
        "conflict_cells": group.conflict_cells,
        "rigid_conflict_cells": group.rigid_conflict_cells,
        "doubled_walls": group.doubled_walls,
        "bends": [_bend_record(name, bent) for name, bent in group.bends.items()],
        "maps": [
            {"name": name, "reference_from_map": similarity_record(place)}
            for name, place in group.reference_from_map.items()
        ],
    }


def _bend_record(name: str, bent: BentMap) -> dict[str, Any]:
    """Build the record of a bent map: its control grid in cells of the map, and the displacements of the nodes."""
    return {
        "name": name,
        "strain": bent.strain,
        "largest_bend": bent.largest_bend,
        "straightened": bent.straightened,
        "corner": bent.bend.corner.tolist(),
        "spacing": bent.bend.spacing,
        "displacements": bent.bend.nodes.tolist(),
    }


def read_bend(entry: dict[str, Any]) -> BentMap:
    """Read the bend of a map from its record."""
    nodes = frozen_array(np.array(entry["displacements"]), np.float64)
    bend = Bend(frozen_array(np.array(entry["corner"]), np.float64), entry["spacing"], nodes)
    return BentMap(bend, entry["largest_bend"], entry["straightened"])


def has_files(group: MergedGroup, index: int) -> bool:
    """Check if a group's merged map is written: always for the first group, otherwise only if maps were joined."""
    return index == 0 or len(group.reference_from_map) > 1


def scale_text(scale: ScaleRange) -> str:
    """Write a range of scales as ``--scale`` reads it."""
    return "known" if scale == ScaleRange.known() else f"{scale.low:g}:{scale.high:g}"


def _map_record(inputs: MergeInputs, index: int, result: MergeResult) -> dict[str, Any]:
    maps = inputs.maps
    name = maps.names[index]
    placed = result.reference_from_map.get(name)
    return {
        "name": name,
        "file": inputs.files[index],
        "unknown": inputs.unknown[index],
        "fingerprint": map_fingerprint(maps.grids[index]),
        "unit": maps.units[index],
        "resolution": maps.grids[index].frame.resolution,
        "merged": placed is not None,
        "reason": result.left_out.get(name),
        "reference_from_map": None if placed is None else similarity_record(placed),
    }


def pair_record(pair: PairResult) -> dict[str, Any]:
    """Build the record of the answer to a pair."""
    transform, pixels = pair.target_from_source, pair.target_from_source_pixels
    return {
        "target": pair.target,
        "source": pair.source,
        "accepted": pair.accepted,
        "confidence": pair.confidence,
        "reason": pair.reason_text,
        "decided_by": pair.decided_by,
        "pair_reason": None if pair.pair_refusal is None else str(pair.pair_refusal),
        "target_from_source": None if transform is None else similarity_record(transform),
        "unit": pair.unit,
        "target_from_source_pixels": None if pixels is None else pixels.tolist(),
        "covariance": None if pair.covariance is None else pair.covariance.tolist(),
        "evidence": None if pair.evidence is None else dataclasses.asdict(pair.evidence),
        "alternatives": [
            {"target_from_source": similarity_record(other.target_from_source), "score": other.score}
            for other in pair.alternatives
        ],
    }


def read_pair(entry: dict[str, Any]) -> PairResult:
    """Read the result of a pair from its record."""
    transform, pixels, covariance = (
        entry[name] for name in ("target_from_source", "target_from_source_pixels", "covariance")
    )
    return PairResult(
        target=entry["target"],
        source=entry["source"],
        accepted=entry["accepted"],
        confidence=entry["confidence"],
        refusal=_read_refusal(entry["reason"]),
        target_from_source=None if transform is None else similarity_from_record(transform),
        target_from_source_pixels=None if pixels is None else np.array(pixels),
        unit=entry["unit"],
        evidence=None if entry["evidence"] is None else Evidence(**entry["evidence"]),
        covariance=None if covariance is None else np.array(covariance),
        alternatives=tuple(
            Alternative(similarity_from_record(other["target_from_source"]), other["score"])
            for other in entry["alternatives"]
        ),
        decided_by=entry["decided_by"],
        pair_refusal=_read_refusal(entry["pair_reason"]),
    )


def _read_refusal(text: str | None) -> Refusal | None:
    return None if text is None else Refusal.from_text(text)


@dataclass(frozen=True)
class GroupRecord:
    """Hold a group of joined maps as merge.json lists it; ``merged`` is the name of the merged map, or None."""

    reference: str
    reference_from_map: dict[str, Similarity2]
    merged: str | None


@dataclass(frozen=True)
class MergeAnswer:
    """Hold the content of a run's merge.json: the method, the pairs in order, the transforms of the joined maps into
    the reference's frame, and all groups, with that of the reference first."""

    method: str
    reference: str
    reference_from_map: dict[str, Similarity2]
    pairs: tuple[PairResult, ...]
    groups: tuple[GroupRecord, ...] = ()

    added: frozenset[str] = frozenset()
    """Maps that were added to the run's own; their true transforms are unknown."""

    def without_added(self) -> MergeAnswer:
        """Keep the results of the run's own maps. The reference may still be an added map."""

        def own(placed: dict[str, Similarity2]) -> dict[str, Similarity2]:
            return {name: place for name, place in placed.items() if name not in self.added}

        return dataclasses.replace(
            self,
            reference_from_map=own(self.reference_from_map),
            pairs=tuple(pair for pair in self.pairs if not {pair.target, pair.source} & self.added),
            groups=tuple(
                dataclasses.replace(group, reference_from_map=own(group.reference_from_map)) for group in self.groups
            ),
        )


def load_answer(path: Path) -> MergeAnswer:
    """Read merge.json. Raises ``ValueError`` or ``OSError`` naming the file and the fault."""
    record = read_record(path, "merge")
    placed = {
        entry["name"]: similarity_from_record(entry["reference_from_map"])
        for entry in record["maps"]
        if entry["reference_from_map"] is not None
    }
    groups = tuple(_read_group(entry) for entry in record["groups"])
    pairs = tuple(read_pair(entry) for entry in record["pairs"])
    added = frozenset(entry["name"] for entry in record["maps"] if entry["file"].startswith(f"{INPUTS}/"))
    return MergeAnswer(record["method"], record["reference"], placed, pairs, groups, added)


def _read_group(entry: dict[str, Any]) -> GroupRecord:
    placed = {one["name"]: similarity_from_record(one["reference_from_map"]) for one in entry["maps"]}
    return GroupRecord(entry["reference"], placed, entry["merged"])
