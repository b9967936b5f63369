"""From answers for pairs to one frame for all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mapping.similarity2 import Similarity2
from merge.result import PairResult


@dataclass(frozen=True)
class Frames:
    """The reference map, the transforms into it of all that could be joined, and why the others could not."""

    reference: str
    reference_from_map: Mapping[str, Similarity2]
    left_out: Mapping[str, str]


def one_frame(known_cells: Mapping[str, int], pairs: Sequence[PairResult]) -> Frames:
    """Join maps along the surest accepted pairs.

    A maximum spanning tree by confidence (Kruskal 1956); the largest group, by number of maps, then by known cells,
    gives the frame; its reference is the map that knows most cells, the earlier of equals. ``known_cells`` names all
    maps in order.
    """
    group_of = {name: {name: Similarity2.identity()} for name in known_cells}
    for pair in sorted((p for p in pairs if p.accepted), key=lambda p: (-p.confidence, p.target, p.source)):
        _join(group_of, pair)
    largest = max(group_of.values(), key=lambda group: (len(group), sum(known_cells[name] for name in group)))
    reference = max((name for name in known_cells if name in largest), key=lambda name: known_cells[name])
    reference_from_group = largest[reference].inverse()
    joined = {name: reference_from_group @ largest[name] for name in known_cells if name in largest}
    joined[reference] = Similarity2.identity()
    left_out = {name: _why_not(name, joined, pairs) for name in known_cells if name not in joined}
    return Frames(reference, joined, left_out)


def _join(group_of: dict[str, dict[str, Similarity2]], pair: PairResult) -> None:
    target_group, source_group = group_of[pair.target], group_of[pair.source]
    if target_group is source_group or pair.target_from_source is None:
        return
    target_group_from_source_group = (
        target_group[pair.target] @ pair.target_from_source @ source_group[pair.source].inverse()
    )
    for name, source_group_from_map in source_group.items():
        target_group[name] = target_group_from_source_group @ source_group_from_map
        group_of[name] = target_group


def _why_not(name: str, joined: Mapping[str, Similarity2], pairs: Sequence[PairResult]) -> str:
    tried = [pair for pair in pairs if name in (pair.target, pair.source)]
    refused = [pair for pair in tried if {pair.target, pair.source} & joined.keys()]
    nearest = max(refused, key=lambda pair: pair.confidence)
    other = nearest.source if nearest.target == name else nearest.target
    return f"with {other}: {nearest.reason}"
