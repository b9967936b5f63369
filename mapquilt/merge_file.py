"""The merger's answer as merge.json has it, and back."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mapping.map_set import MapSet
from mapping.similarity2 import Similarity2
from mapquilt.json_file import read_record, similarity_from_record, similarity_record
from merge.result import MergeResult, PairResult
from merge.scale_range import ScaleRange
from merge.settings import MergeSettings

SCHEMA = "mapquilt-merge/1"


def merge_record(maps: MapSet, settings: MergeSettings, seed: int, result: MergeResult) -> dict[str, Any]:
    """The record of a merge: one entry per map, one per unordered pair; schema ``merge``."""
    return {
        "schema": SCHEMA,
        "method": settings.title,
        "scale": _scale_text(settings.scale or ScaleRange.automatic(maps)),
        "seed": seed,
        "min_confidence": settings.decision.min_confidence,
        "confidence_calibrated": result.confidence_calibrated,
        "reference": result.reference,
        "maps": [_map_record(maps, index, result) for index in range(len(maps))],
        "pairs": [_pair_record(pair) for pair in result.pairs],
    }


def _scale_text(scale: ScaleRange) -> str:
    return "known" if scale == ScaleRange.known() else f"{scale.low:g}:{scale.high:g}"


def _map_record(maps: MapSet, index: int, result: MergeResult) -> dict[str, Any]:
    name = maps.names[index]
    placed = result.reference_from_map.get(name)
    return {
        "name": name,
        "unit": maps.units[index],
        "resolution": maps.grids[index].frame.resolution,
        "merged": placed is not None,
        "reason": result.left_out.get(name),
        "reference_from_map": None if placed is None else similarity_record(placed),
    }


def _pair_record(pair: PairResult) -> dict[str, Any]:
    transform, pixels = pair.target_from_source, pair.target_from_source_pixels
    return {
        "target": pair.target,
        "source": pair.source,
        "accepted": pair.accepted,
        "confidence": pair.confidence,
        "reason": pair.reason,
        "target_from_source": None if transform is None else similarity_record(transform),
        "unit": pair.unit,
        "target_from_source_pixels": None if pixels is None else pixels.tolist(),
        "covariance": None if pair.covariance is None else pair.covariance.tolist(),
        "evidence": None if pair.evidence is None else dataclasses.asdict(pair.evidence),
        "alternatives": [
            {"target_from_source": similarity_record(other.target_from_source), "agreement": other.agreement}
            for other in pair.alternatives
        ],
    }


@dataclass(frozen=True)
class PairRecord:
    """What merge.json says of one pair."""

    target: str
    source: str
    accepted: bool
    confidence: float
    reason: str | None
    target_from_source: Similarity2 | None
    acceptance_index: float | None


@dataclass(frozen=True)
class MergeAnswer:
    """What merge.json says of a run: the pairs in order, and where the joined maps lie in the reference's frame."""

    reference: str
    reference_from_map: dict[str, Similarity2]
    pairs: tuple[PairRecord, ...]


def load_answer(path: Path) -> MergeAnswer:
    """Read merge.json. Raises ``ValueError`` or ``OSError`` naming the file and what is wrong."""
    record = read_record(path, "merge")
    placed = {
        entry["name"]: similarity_from_record(entry["reference_from_map"])
        for entry in record["maps"]
        if entry["reference_from_map"] is not None
    }
    return MergeAnswer(record["reference"], placed, tuple(_read_pair(entry) for entry in record["pairs"]))


def _read_pair(entry: dict[str, Any]) -> PairRecord:
    transform = entry["target_from_source"]
    return PairRecord(
        entry["target"],
        entry["source"],
        entry["accepted"],
        entry["confidence"],
        entry["reason"],
        None if transform is None else similarity_from_record(transform),
        (entry["evidence"] or {}).get("acceptance_index"),
    )
