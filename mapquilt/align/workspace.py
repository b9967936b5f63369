"""The workspace of the page: the maps, their arrangement with its history, and what can be asked of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet
from mapquilt.align.arrangement import Arrangement, History, Placement, Solved, start_arrangement
from mapquilt.align.measurement import PairMeasurer
from mapquilt.align.merge_command import arranged_settings
from mapquilt.align.snap import Snap, snap_near
from mapquilt.merging.merge_inputs import MergeInputs
from merge.merger import merge_maps
from merge.pair.feature_cache import FeatureCache
from merge.pair.pipeline import match, match_near
from merge.pair.task import PairTask
from merge.records.result import PairResult
from merge.settings import MergeSettings

Pair = tuple[int, int]


@dataclass(frozen=True, eq=False)
class AlignTask:
    """Maps to align: the inputs, settings and seed of their merge, the ``folder`` of the answer, the ``sources`` that
    a command names to merge them again, and what an older merge already knows.

    ``known`` are its answers of pairs, by the indices of target and source. ``source_names`` are the names that the
    command gives the maps, where they are others.
    """

    inputs: MergeInputs
    settings: MergeSettings
    seed: int
    folder: Path
    sources: tuple[str, ...]
    known: Mapping[Pair, PairResult] = field(default_factory=dict)
    arrangement: Arrangement | None = None
    source_names: tuple[str, ...] | None = None


class Workspace:
    """Hold the present state of the page. Each method that changes it adds a step to the history."""

    def __init__(self, task: AlignTask) -> None:
        self.task = task
        self.maps: MapSet = task.inputs.maps
        self.history = History(task.arrangement or start_arrangement(self.maps))
        self.measurer = PairMeasurer(self.maps, task.settings)
        self._cache = FeatureCache(task.settings.preparation, kept=len(self.maps))
        self._answers: dict[Pair, PairResult] = dict(task.known)

    @property
    def arrangement(self) -> Arrangement:
        return self.history.now

    @property
    def scale_range(self) -> ScaleRange:
        return self.task.settings.scale or self.maps.scale_range

    def change(self, arrangement: Arrangement) -> None:
        """Add a step to the history."""
        self.history = self.history.changed(arrangement)

    def undo(self) -> None:
        """Go back a step."""
        self.history = self.history.undone()

    def redo(self) -> None:
        """Go forward a step that was undone."""
        self.history = self.history.redone()

    def place(self, index: int, pose: Similarity2) -> None:
        """Place a map where a person's hand put it.

        Raises ``ValueError`` for the reference of more than two maps: its move would not tell on which of them it lies.
        """
        other = None
        if index == self.arrangement.reference and len(self.maps) > 1:
            if len(self.maps) > 2:
                raise ValueError(
                    f"{self.maps.names[index]}: is the reference; make another map the reference to move it"
                )
            other = 1 - index
        self.change(self.arrangement.placed(index, Placement(pose, "hand"), other))

    def partner(self, index: int, others: Sequence[int]) -> int:
        """Choose the map that fits best where a map lies, of the ``others``; of equals the nearest, in their order.

        Raises ``ValueError`` if there is none.
        """
        others = [other for other in others if other != index]
        if not others:
            raise ValueError(f"{self.maps.names[index]}: there is no other visible map to compare it with")
        score, distance = {}, {}
        for other in others:
            score[other] = self.measurer.measure(
                other, index, self.arrangement.target_from_source(other, index)
            ).overlap.score
            distance[other] = self._distance(index, other)
        return max(others, key=lambda other: (score[other], -distance[other]))

    def _distance(self, index: int, other: int) -> float:
        """Return the distance between the middles of two maps' walls on the sheet."""
        middles = [
            self.arrangement.placements[each].sheet_from_map.apply(points.mean(axis=0))
            for each in (index, other)
            if len(points := self.measurer.wall_points(each))
        ]
        return float(abs(complex(*(middles[0] - middles[1])))) if len(middles) == 2 else 0.0

    def snap(self, index: int, other: int) -> PairResult:
        """Match a map to another near the place where it lies, and move it there; a refused match moves it too.

        A map with which nothing near fits stays where it is.
        """
        snap = self.snap_task(index, other)
        answer = match_near(snap.task, self._cache)
        if answer.target_from_source is not None:
            sheet = self.arrangement.placements[other].sheet_from_map
            pose = sheet @ snap.target_from_source(answer.target_from_source)
            self.change(self.arrangement.placed(index, Placement(pose, "snap"), other))
        return answer

    def snap_task(self, index: int, other: int) -> Snap:
        """Make the task of a snap, with the moved map as source."""
        pair = PairTask.of(self.maps, other, index, self.scale_range, self.task.settings, self.task.seed)
        pose = self.arrangement.target_from_source(other, index)
        return snap_near(pair, pose, self.measurer.wall_points(index), self.task.settings)

    def candidates(self, index: int, other: int) -> tuple[PairResult, tuple[tuple[Similarity2, float], ...]]:
        """Match two maps wherever they lie; return the answer, and the transform and score of it and its alternatives.

        Transforms are from the map ``index`` to the ``other``. An answer is kept for the next call.
        """
        pair = min(index, other), max(index, other)
        if pair not in self._answers:
            task = PairTask.of(self.maps, *pair, self.scale_range, self.task.settings, self.task.seed)
            self._answers[pair] = match(task, self._cache)
        answer = self._answers[pair]
        best = answer.target_from_source
        score = 0.0 if answer.evidence is None else answer.evidence.score
        found = [(best, score)] if best is not None else []
        found += [(each.target_from_source, each.score) for each in answer.alternatives]
        return answer, tuple((pose if index == pair[1] else pose.inverse(), score) for pose, score in found)

    def choose(self, index: int, other: int, number: int) -> None:
        """Place a map at a candidate of its match with another. Raises ``ValueError`` if there is no such."""
        _, found = self.candidates(index, other)
        if not 0 <= number < len(found):
            raise ValueError(f"candidate is {number}, must be 0 to {len(found) - 1}")
        sheet = self.arrangement.placements[other].sheet_from_map
        self.change(self.arrangement.placed(index, Placement(sheet @ found[number][0], "choice"), other))

    def solve(self) -> Solved:
        """Merge all maps with the placed ones as priors, and show the answer, unless it is shown already."""
        solved = self.arrangement.solved
        if solved is None:
            settings = arranged_settings(self.task.settings, self.arrangement, self.maps)
            solved = Solved(settings, merge_maps(self.maps, settings, self.task.seed))
            self.change(self.arrangement.with_solution(solved, self.maps.names))
        return solved

    def stitch(self) -> Solved:
        """Stitch all maps where they lie, without verification.

        Raises ``ValueError`` naming a map that nobody placed, or that poses cannot place.
        """
        settings = arranged_settings(self.task.settings, self.arrangement, self.maps, trusted=True)
        return Solved(settings, merge_maps(self.maps, settings, self.task.seed))
