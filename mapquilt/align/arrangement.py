"""Arrangement of maps on a sheet, and its history for undo and redo."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet
from merge.records.result import MergeResult
from merge.settings import MergeSettings

DecidedBy = Literal["start", "hand", "snap", "choice", "automatic"]
"""Decider of a placement: nobody yet; a person's hand; the alignment near the hand's placement; a person's choice among
the merger's candidates; or the merger alone."""

PINNED: tuple[DecidedBy, ...] = ("hand", "snap", "choice")
"""Placements that a person has decided, and that become priors of a merge."""

MOST_UNDONE = 500
"""Steps that undo goes back: a session of hours, a few kB each."""


@dataclass(frozen=True)
class Placement:
    """Pose of a map on the sheet, from its stated metres, and who decided it."""

    sheet_from_map: Similarity2
    decided_by: DecidedBy = "start"


@dataclass(frozen=True, eq=False)
class Solved:
    """A merge whose poses an arrangement shows: its settings and its result."""

    settings: MergeSettings
    result: MergeResult


@dataclass(frozen=True, eq=False)
class Arrangement:
    """Placements of all maps, the index of the reference, and the merge that gave them, if one did."""

    placements: tuple[Placement, ...]
    reference: int = 0
    solved: Solved | None = None

    def placed(self, index: int, placement: Placement, other: int | None = None) -> Arrangement:
        """Place one map. Any merge before no longer gives the poses.

        A person who moves the reference to an ``other`` map decides where that one lies on the reference.
        """
        placements = list(self.placements)
        placements[index] = placement
        if index == self.reference and other is not None:
            placements[other] = _decided_like(placements[other], placement)
        return Arrangement(tuple(placements), self.reference)

    def with_reference(self, index: int) -> Arrangement:
        """Name another reference. If a person placed it on the former one, that is now placed on it."""
        if index == self.reference:
            return self
        placements, before = list(self.placements), self.reference
        placements[before] = _decided_like(placements[before], placements[index])
        return Arrangement(tuple(placements), index)

    def target_from_source(self, target: int, source: int) -> Similarity2:
        """Return the transform between two maps, in their stated metres."""
        return self.placements[target].sheet_from_map.inverse() @ self.placements[source].sheet_from_map

    def with_solution(self, solved: Solved, names: Sequence[str]) -> Arrangement:
        """Show the first group of a merge; maps outside of it stay where they are.

        A placement that a person has decided keeps its decider, though the merger has refined it.
        """
        poses = solved.result.reference_from_map
        sheet = self.placements[names.index(solved.result.reference)].sheet_from_map
        placements = tuple(
            Placement(sheet @ poses[name], each.decided_by if each.decided_by in PINNED else "automatic")
            if name in poses
            else each
            for name, each in zip(names, self.placements, strict=True)
        )
        return replace(self, placements=placements, solved=solved)


def _decided_like(placement: Placement, decided: Placement) -> Placement:
    """Return a placement that nobody has decided with the decider of another, if that is a person."""
    if placement.decided_by in PINNED or decided.decided_by not in PINNED:
        return placement
    return replace(placement, decided_by=decided.decided_by)


@dataclass(frozen=True, eq=False)
class History:
    """The present arrangement, those before it, the last one last, and those that were undone, the next one last."""

    now: Arrangement
    past: tuple[Arrangement, ...] = ()
    future: tuple[Arrangement, ...] = ()

    def changed(self, now: Arrangement) -> History:
        """Add a step, after which nothing can be redone; an arrangement that is the present one is no step."""
        return self if now is self.now else History(now, (*self.past, self.now)[-MOST_UNDONE:])

    def undone(self) -> History:
        """Go back a step; the history itself if there is none."""
        return History(self.past[-1], self.past[:-1], (*self.future, self.now)) if self.past else self

    def redone(self) -> History:
        """Go forward a step that was undone; the history itself if there is none."""
        return History(self.future[-1], (*self.past, self.now), self.future[:-1]) if self.future else self


def start_arrangement(maps: MapSet) -> Arrangement:
    """Lay the middle of each map's known part on that of the first map.

    A map without a resolution gets cells as large as those of the first one.
    """
    middles = [_middle(maps, index) for index in range(len(maps))]
    placements = []
    for index, (x, y) in enumerate(middles):
        scale = _start_scale(maps, index)
        placements.append(Placement(Similarity2(middles[0][0] - scale * x, middles[0][1] - scale * y, 0.0, scale)))
    return Arrangement(tuple(placements))


def _middle(maps: MapSet, index: int) -> tuple[float, float]:
    frame = maps.grids[index].cropped().frame
    rows, cols = frame.shape
    x, y = frame.metres_from_cells([rows / 2.0 - 0.5, cols / 2.0 - 0.5]).tolist()
    return x, y


def _start_scale(maps: MapSet, index: int) -> float:
    if "cell" not in (maps.units[0], maps.units[index]):
        return 1.0
    return maps.grids[0].frame.resolution / maps.grids[index].frame.resolution
