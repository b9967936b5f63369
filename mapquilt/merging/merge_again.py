"""Results of an earlier merge that remain valid when a map is added or has changed."""

from __future__ import annotations

from pathlib import Path

from mapping.map_set import MapSet
from mapquilt.merging.merge_file import read_pair, settings_record
from mapquilt.merging.merge_inputs import map_fingerprint, read_merge
from merge.multimap.verdicts import verdict_by_itself
from merge.records.result import PairResult
from merge.settings import MergeSettings


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
