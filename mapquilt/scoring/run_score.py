"""Score of a merged run: every pair and every merged map against the truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.evaluation.aggregation import outcome_counts
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, GroundTruth, PairInfo, evaluate_pair
from mapquilt.evaluation.map_quality import MapQuality, align_to_world, map_quality, median_pose_error, observed_part
from mapquilt.runs.truth_file import RunTruth
from merge.records.result import PairResult


@dataclass(frozen=True)
class MergedMapScore:
    """Quality of the merged map of ``maps``, over what they could observe, and the median error of their places."""

    reference: str
    maps: tuple[str, ...]
    quality: MapQuality
    pose_error_m: float


@dataclass(frozen=True)
class RunScore:
    """All pairs of a run beside their truth, and the quality of each merged map."""

    pairs: tuple[EvaluatedPair, ...]
    merged: tuple[MergedMapScore, ...] = ()

    def summary(self) -> dict[str, int]:
        counts = {
            "pairs": len(self.pairs),
            "accepted": sum(bool(one.accepted) for one in self.pairs),
            "right": sum(one.right for one in self.pairs),
        }
        return counts | outcome_counts(self.pairs)


def evaluate_run_pair(
    maps: MapSet, truth: RunTruth, answer: PairResult, info: PairInfo, method: str = ""
) -> EvaluatedPair:
    """Evaluate one answer of a run. Maps, truth and answer must be of the same run."""
    target, source = (maps.grids[maps.names.index(name)] for name in (answer.target, answer.source))
    return evaluate_pair(
        target, source, run_ground_truth(truth, answer.target, answer.source), answer, pair=info, method=method
    )


def run_ground_truth(truth: RunTruth, target: str, source: str) -> GroundTruth:
    """Read the truth of one pair of a run."""
    return GroundTruth.of(truth.pairs[target, source], truth.robot(target).truth.world_from_map.scale)


def score_merged_map(
    maps: MapSet,
    truth: RunTruth,
    reference_from_map: Mapping[str, Similarity2],
    reference: str,
    merged: OccupancyGrid,
    world: OccupancyGrid,
    footprints: Mapping[str, OccupancyGrid],
) -> MergedMapScore:
    """Compare a merged map with the part of the true raster ``world`` that the given footprints observed."""
    world_from_map = {name: truth.robot(name).truth.world_from_map for name in reference_from_map}
    world_from_reference = align_to_world(maps, world_from_map, reference_from_map)
    return MergedMapScore(
        reference=reference,
        maps=tuple(name for name in maps.names if name in reference_from_map),
        quality=map_quality(merged, world_from_reference, observed_part(world, list(footprints.values()))),
        pose_error_m=median_pose_error(maps, world_from_map, reference_from_map, world_from_reference),
    )
