"""Pairs of the regression set: of each family one short mission at several noise levels, and maps of two families."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame_perturbation import FramePerturbationRanges
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.evaluation.evaluated_pair import GroundTruth, PairInfo, evaluate_pair
from mapquilt.jobs.timing import one_thread
from mapquilt.runs.sample import Sample, make_sample
from mapquilt.runs.true_footprints import true_footprints
from mapquilt.scoring.run_score import run_ground_truth
from mapquilt.settings import SampleSettings
from merge.merger import match_maps
from merge.settings import MergeSettings
from sim.mission.settings import MissionSettings, Starts
from sim.mission.simulation import simulate
from sim.sensors.settings import SensingSettings
from tests.regression.golden import GoldenPair
from worlds.families.registry import FAMILIES, make_world

SEED = 20_090
ROBOTS, DURATION = 3, 60.0
SAMPLES = (
    ("noise-0.5", SampleSettings(SensingSettings(0.5), perturbation=FramePerturbationRanges(1.0, 1.0), seed=SEED)),
    ("noise-1", SampleSettings(SensingSettings(1.0), perturbation=FramePerturbationRanges(), seed=SEED + 1)),
    ("noise-2", SampleSettings(SensingSettings(2.0), perturbation=FramePerturbationRanges(), seed=SEED + 2)),
)
WIDE = 40.0
"""In families wider than this [m] robots begin close together, so that a short mission has overlap; not in worlds of
separate parts, where every merge must be refused."""
DECIMALS = 6
"""Rounding of the truth in the hash of a sample: its last bits must not change the hash."""


@dataclass(frozen=True, eq=False)
class RegressionPair:
    """Two maps and their truth. ``transform`` is the true one, None for maps of two worlds."""

    family: str
    name: str
    target: OccupancyGrid
    source: OccupancyGrid
    trusted: bool
    truth: GroundTruth
    transform: Similarity2 | None = None

    def digest(self) -> str:
        """Hash the input of the merger and the truth: 16 digits of a SHA-256."""
        sha = hashlib.sha256()
        for grid in (self.target, self.source):
            frame = grid.frame
            place = (frame.resolution, frame.origin.x, frame.origin.y, frame.origin.yaw)
            sha.update(grid.occupancy().tobytes() + repr((frame.shape, np.round(place, DECIMALS).tolist())).encode())
        true = self.transform
        if true is not None:
            place = (true.x, true.y, true.yaw, true.scale)
            sha.update(repr(np.round(place, DECIMALS).tolist()).encode())
        return sha.hexdigest()[:16]


def family_samples(family: str) -> dict[str, Sample]:
    """Simulate one mission of the family, and sense it at all levels; the result depends on the name alone."""
    world = make_world(family, SEED)
    starts: Starts = "close" if FAMILIES[family].width >= WIDE and world.parts == 1 else "random"
    mission, _ = simulate(world, MissionSettings(ROBOTS, DURATION, starts), SEED)
    places = true_footprints(mission)
    return {name: make_sample(mission, settings, places) for name, settings in SAMPLES}


def all_pairs(samples: dict[str, dict[str, Sample]]) -> Iterator[RegressionPair]:
    """Yield the pairs of each family's samples, and its first map at level 1 with that of the next family."""
    families = [family for family in FAMILIES if family in samples]
    for family in families:
        for name, sample in samples[family].items():
            yield from _of_one_sample(family, name, sample)
    for family, other in zip(families, [*families[1:], families[0]], strict=True):
        if family != other:
            yield _of_two_worlds(family, other, samples[family]["noise-1"], samples[other]["noise-1"])


def _of_one_sample(family: str, name: str, sample: Sample) -> Iterator[RegressionPair]:
    grids: Sequence[tuple[str, OccupancyGrid]] = list(zip(sample.maps.names, sample.maps.grids, strict=True))
    for (target, target_grid), (source, source_grid) in combinations(grids, 2):
        yield RegressionPair(
            family=family,
            name=f"{name}: {target} <- {source}",
            target=target_grid,
            source=source_grid,
            trusted=sample.maps.resolutions_trusted,
            truth=run_ground_truth(sample.truth, target, source),
            transform=sample.truth.pairs[target, source].target_from_source,
        )


def _of_two_worlds(family: str, other: str, sample: Sample, other_sample: Sample) -> RegressionPair:
    target, source = sample.maps.grids[0], other_sample.maps.grids[0]
    return RegressionPair(family, f"other world: {other}", target, source, False, GroundTruth(None, overlap=0.0))


def evaluate(pair: RegressionPair) -> GoldenPair:
    """Merge a pair by the default method on one thread, and evaluate it."""
    maps = MapSet(("target", "source"), (pair.target, pair.source), ("m", "m"), resolutions_trusted=pair.trusted)
    settings = MergeSettings()
    with one_thread():
        (result,) = match_maps(maps, settings, SEED)
    info = PairInfo(pair.name, result.target, result.source, world=pair.family)
    found = evaluate_pair(pair.target, pair.source, pair.truth, result, pair=info, method=settings.title)
    return GoldenPair.of(found, pair.digest())
