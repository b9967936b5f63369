"""Pairs judged again where it is known from elsewhere how they lie: from the rest of the team, or from start poses."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from mapping.geometry.similarity2 import Similarity2
from merge.multimap.edge import Edge, LocalFrame, edge_of
from merge.pair.feature_cache import FeatureCache, metres_from_prepared
from merge.pair.matching import PairTask, process_feature_cache, told
from merge.pair.pipeline import answer_near
from merge.records.prior import Expected
from merge.records.reason import Reason, Refusal
from merge.records.result import DecidedBy, PairResult


@dataclass(frozen=True, eq=False)
class NearTask:
    """A pair to be judged near a place, metres to metres, or anywhere that is expected."""

    pair: PairTask
    place: Similarity2 | Expected


def match_near(task: NearTask, shelf: FeatureCache | None = None) -> PairResult:
    """The answer for a pair near that place; what else looks like it elsewhere is no rival."""
    pair = task.pair
    sheets = pair.sheets(shelf or process_feature_cache(), pair.methods)
    target_metres, source_metres = (
        metres_from_prepared(grid.frame, sheet.chart) for grid, sheet in zip(pair.grids, sheets, strict=True)
    )
    scale = pair.in_cells(pair.scale, sheets)
    if isinstance(task.place, Expected):
        places = task.place.starts(sheets[0].chart, target_metres, source_metres)
    else:
        places = [target_metres.inverse() @ task.place @ source_metres]
    places = [dataclasses.replace(place, scale=scale.clip(place.scale)) for place in places]
    return told(pair, answer_near(*sheets, places, scale, pair.settings.acceptance), sheets)


def refused(pair: PairResult, reason: Reason, by: DecidedBy) -> PairResult:
    """An accepted answer that others contradict."""
    return dataclasses.replace(pair, accepted=False, refusal=Refusal(reason), decided_by=by)


def won(before: PairResult | None, now: PairResult, by: DecidedBy) -> PairResult:
    """An answer that the team explains, in place of a refusal, whose reason it keeps."""
    reason = None if before is None else before.pair_refusal or before.refusal
    return dataclasses.replace(now, decided_by=by, pair_refusal=reason)


def not_tried(task: PairTask, reason: Reason) -> PairResult:
    """What is told of a pair that was not matched."""
    return PairResult(*task.names, False, 0.0, Refusal(reason), None, None, task.units[0], None, decided_by="team")


def by_itself(pair: PairResult) -> PairResult | None:
    """What a pair was worth before the team was heard; None where it was not tried."""
    if pair.decided_by == "pair":
        return pair
    if pair.reason in (Reason.CONTRADICTS_TEAM, Reason.CONTRADICTS_PRIOR):
        return dataclasses.replace(pair, accepted=True, refusal=None, decided_by="pair")
    if pair.pair_refusal is not None:
        return dataclasses.replace(
            pair, accepted=False, refusal=pair.pair_refusal, pair_refusal=None, decided_by="pair", confidence=0.0
        )
    return None


def edge(pair: PairResult, indices: tuple[int, int], grounds: tuple[LocalFrame, ...]) -> Edge:
    """The edge of an answer, lower index first."""
    found = edge_of(pair, indices, grounds)
    return found if found.target < found.source else found.reversed()
