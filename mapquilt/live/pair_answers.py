"""Answers of the pairs of running robots, matched again only as their maps change."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapquilt.live.placement import Sighting, displacement
from mapquilt.live.robots import Robot
from mapquilt.live.settings import LiveSettings
from merge.pair.feature_cache import FeatureCache
from merge.pair.pipeline import GuidedTask, match, match_near
from merge.pair.task import PairTask
from merge.records.result import PairResult

Names = tuple[str, str]
"""Names of two robots, the one that was heard first as the target."""


@dataclass(frozen=True, eq=False)
class KnownPair:
    """The last answer of a pair.

    ``versions`` are those of the maps that gave it; ``searched`` the known cells of both at the last match from
    scratch, None if a new one is due. A match near a guess is blind to better places elsewhere, so its answer is never
    surer than the ``ceiling``: the confidence of that last match, or of what placed the two maps. ``turn`` is the
    number of the update. A pair is ``challenged`` if it was accepted, and more cells then make a match from scratch
    refuse the same place: only another such match accepts it again.
    """

    answer: PairResult
    versions: tuple[int, int]
    searched: tuple[int, int] | None
    ceiling: float
    turn: int
    challenged: bool = False


Known = Mapping[Names, KnownPair]


def match_changed(
    robots: Sequence[Robot],
    known: Known,
    placed: Mapping[str, Sighting],
    cache: FeatureCache,
    turn: int,
    settings: LiveSettings = LiveSettings(),
) -> dict[Names, KnownPair]:
    """Match pairs again whose maps have changed, and return all answers; ``turn`` counts the updates.

    An accepted pair is matched near its last answer, which costs a tenth; so is a refused pair of two maps that are
    ``placed``, near their poses ``merged_from_map``. Others are matched from scratch once their maps have grown. The
    pairs that have waited longest come first; both numbers are bounded.
    """
    pairs = {(a.name, b.name): (a, b) for a, b in combinations([each for each in robots if each.grid is not None], 2)}
    found = {names: entry for names, entry in known.items() if names in pairs}

    def waited(names: Names) -> int:
        return found[names].turn if names in found else -1

    near = {
        names: guess
        for names, pair in pairs.items()
        if names in found
        and _changed(found[names], pair)
        and (guess := _guess(names, found[names], placed)) is not None
    }
    for names in sorted(near, key=waited)[: settings.guided_matches]:
        before, (pose, ceiling) = found[names], near[names]
        answer = match_near(GuidedTask(_task(pairs[names], settings), pose), cache)
        answer = dataclasses.replace(answer, confidence=min(answer.confidence, ceiling))
        searched = None if before.answer.accepted and not answer.accepted else before.searched
        found[names] = KnownPair(answer, _versions(pairs[names]), searched, ceiling, turn)
    scratch = [names for names in pairs if _is_due(found.get(names), pairs[names], names, placed, settings)]
    for names in sorted(scratch, key=waited)[: settings.full_matches]:
        entry = _from_scratch(pairs[names], cache, turn, settings)
        found[names] = entry if names not in found else _after_scratch(found[names], entry, pairs[names][1], settings)
    return found


def match_new(
    robots: Sequence[Robot], known: Known, cache: FeatureCache, turn: int, settings: LiveSettings = LiveSettings()
) -> dict[Names, KnownPair] | None:
    """Match the first pair that never was, and return all answers; None if there is no such pair."""
    for pair in combinations([each for each in robots if each.grid is not None], 2):
        names = pair[0].name, pair[1].name
        if names not in known:
            return {**known, names: _from_scratch(pair, cache, turn, settings)}
    return None


def _from_scratch(pair: tuple[Robot, Robot], cache: FeatureCache, turn: int, settings: LiveSettings) -> KnownPair:
    answer = match(_task(pair, settings), cache)
    cells = pair[0].known_cells, pair[1].known_cells
    return KnownPair(answer, _versions(pair), cells, answer.confidence, turn)


def _after_scratch(last: KnownPair, entry: KnownPair, source: Robot, settings: LiveSettings) -> KnownPair:
    """Weigh the answer of a match from scratch, ``entry``, against the last answer."""
    before, scratch = last.answer, entry.answer
    if scratch.accepted:
        return entry
    if not before.accepted:
        return dataclasses.replace(entry, challenged=last.challenged)
    if _is_missed(before, scratch, source, settings):
        return dataclasses.replace(entry, answer=before)
    return dataclasses.replace(entry, challenged=True)


def _is_missed(before: PairResult, scratch: PairResult, source: Robot, settings: LiveSettings) -> bool:
    """Check if a refused match from scratch missed the accepted place: it ended elsewhere, with a lower score."""
    if scratch.target_from_source is None or scratch.evidence is None:
        return True
    if before.target_from_source is None or before.evidence is None:
        return False
    elsewhere = not _are_near(before.target_from_source, scratch.target_from_source, source, settings)
    return elsewhere and scratch.evidence.score < before.evidence.score


def _are_near(first: Similarity2 | None, second: Similarity2 | None, source: Robot, settings: LiveSettings) -> bool:
    """Check if two transforms put the source at the same place."""
    if first is None or second is None:
        return False
    shift, turn = displacement(first, second, source.middle)
    return shift <= settings.same_place and turn <= settings.same_yaw


def _task(pair: tuple[Robot, Robot], settings: LiveSettings) -> PairTask:
    grids = tuple(each.grid for each in pair if each.grid is not None)
    names, scale = (pair[0].name, pair[1].name), ScaleRange.known()
    return PairTask(names, (grids[0], grids[1]), ("m", "m"), scale, settings.merge, settings.seed)


def _versions(pair: tuple[Robot, Robot]) -> tuple[int, int]:
    return pair[0].version, pair[1].version


def _changed(entry: KnownPair, pair: tuple[Robot, Robot]) -> bool:
    return entry.versions != _versions(pair)


def _guess(names: Names, entry: KnownPair, placed: Mapping[str, Sighting]) -> tuple[Similarity2, float] | None:
    """Return the transform near which a pair is matched again, and its confidence; None if nothing says one."""
    if entry.answer.accepted and entry.answer.target_from_source is not None:
        return entry.answer.target_from_source, entry.ceiling
    if names[0] in placed and names[1] in placed and not entry.challenged:
        target, source = placed[names[0]], placed[names[1]]
        return target.merged_from_map.inverse() @ source.merged_from_map, min(target.confidence, source.confidence)
    return None


def _is_due(
    entry: KnownPair | None,
    pair: tuple[Robot, Robot],
    names: Names,
    placed: Mapping[str, Sighting],
    settings: LiveSettings,
) -> bool:
    """Check if a pair is to be matched from scratch."""
    if entry is None or entry.searched is None:
        return True
    if not entry.answer.accepted and not entry.challenged and names[0] in placed and names[1] in placed:
        return False
    return any(
        each.known_cells >= (1.0 + settings.growth) * cells for each, cells in zip(pair, entry.searched, strict=True)
    )


def without(known: Known, robot: str) -> dict[Names, KnownPair]:
    """Forget the answers of a robot whose frame is new."""
    return {names: entry for names, entry in known.items() if robot not in names}
