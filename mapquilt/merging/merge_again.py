"""Settings and results of an earlier merge that remain valid when a map is added or has changed."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

from mapping.geometry.scale_range import ScaleRange
from mapping.map_set import MapSet
from mapquilt.leaves import with_assignments
from mapquilt.merging.merge_file import MergeTree, read_pair, scale_text, settings_record
from mapquilt.merging.merge_inputs import map_fingerprint, read_merge
from merge.multimap.verdicts import verdict_by_itself
from merge.records.prior import Prior
from merge.records.result import MergeResult, PairResult
from merge.settings import PUBLISHED, MergeSettings


def settings_before(record: Mapping[str, Any], resolutions_trusted: bool) -> MergeSettings:
    """Return the settings that a merge.json records, and its reference as the one to keep.

    A recorded scale that is the one which the maps have by themselves was not asked for. The reference is not kept
    where priors would take it for one more map whose pose is known, or where it is the only map with a prior.
    """
    priors = tuple(Prior(**prior) for prior in record["priors"])
    metric = resolutions_trusted and all(entry["unit"] == "m" for entry in record["maps"])
    own = scale_text(ScaleRange.known() if metric else ScaleRange.free())
    scale = None if record["scale"] == own else ScaleRange.parse(record["scale"])
    placed = {prior.name for prior in priors}
    known = (
        not priors or record.get("reference_requested", False) or (record["reference"] in placed and len(placed) > 1)
    )
    start = MergeSettings(
        method=record["method"].removesuffix(PUBLISHED),
        scale=scale,
        as_published=record["method"].endswith(PUBLISHED),
        reference=record["reference"] if known else None,
        fusion=record["fusion"],
        elastic=record.get("elastic", False),
        priors=priors,
    )
    least = record["min_confidence"]
    if least != start.acceptance.min_confidence:
        start = dataclasses.replace(start, acceptance=dataclasses.replace(start.acceptance, min_confidence=least))
    texts = [f"{name}={setting_text(value)}" for name, value in record["settings"].items()]
    return with_assignments(MergeTree(start), "settings", texts).merge


def setting_text(value: Any) -> str:
    """Write a value as ``--set`` reads it."""
    if value is None or isinstance(value, bool):
        return {None: "none", True: "true", False: "false"}[value]
    return ":".join(map(str, value)) if isinstance(value, list) else str(value)


def unmerged(record: Mapping[str, Any], result: MergeResult) -> tuple[tuple[str, str], ...]:
    """List the pairs of maps that a merge.json has in one group and the result does not."""
    together = set(_together([group.reference_from_map for group in result.groups]))
    before = _together([{entry["name"]: entry for entry in group["maps"]} for group in record["groups"]])
    return tuple(pair for pair in before if pair not in together)


def _together(groups: list[Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    for names in groups:
        yield from combinations(sorted(names), 2)


def answers_before(folder: Path, maps: MapSet, settings: MergeSettings, seed: int) -> dict[tuple[str, str], PairResult]:
    """Return the earlier results of pairs whose maps have not changed, with the pairs' own verdicts; empty if the
    earlier merge had other settings."""
    record = read_merge(folder)
    scale = settings.scale or maps.scale_range
    wanted = settings_record(settings, scale, seed)
    if any(record[name] != value for name, value in wanted.items()):
        return {}
    before = {entry["name"]: entry["fingerprint"] for entry in record["maps"]}
    same = {n for n, grid in zip(maps.names, maps.grids, strict=True) if before.get(n) == map_fingerprint(grid)}
    found = {}
    for entry in record["pairs"]:
        if {entry["target"], entry["source"]} <= same:
            answer = verdict_by_itself(read_pair(entry))
            if answer is not None:
                found[answer.target, answer.source] = answer
    return found
