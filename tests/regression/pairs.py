"""The pairs: of each family of worlds one short mission, sensed at several levels, and maps of two families."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame_perturbation import HONEST, FramePerturbationRanges
from mapping.grid.occupancy_grid import OccupancyGrid
from mapquilt.runs.sample import Sample, SampleSettings, make_sample
from mapquilt.runs.true_footprints import true_places
from sim.mission.mission import simulate
from sim.mission.settings import MissionSettings
from sim.mission.starts import Starts
from sim.sensors.settings import SensingSettings
from worlds.families.registry import FAMILIES, make_world

SEED = 20_090
ROBOTS, DURATION = 3, 60.0
SAMPLES = (
    ("noise-0.5", SampleSettings(SensingSettings(0.5), perturbation=HONEST, seed=SEED)),
    ("noise-1", SampleSettings(SensingSettings(1.0), perturbation=FramePerturbationRanges(), seed=SEED + 1)),
    ("noise-2", SampleSettings(SensingSettings(2.0), perturbation=FramePerturbationRanges(), seed=SEED + 2)),
)
WIDE = 40.0
"""Where a family is wider [m], robots begin close together, or a short mission would leave them nothing in common."""
DECIMALS = 6
"""Of the truth, in the hash of a sample: rounding in its last bits makes no other sample."""


@dataclass(frozen=True, eq=False)
class RegressionPair:
    """Two maps, and where one truly lies in the other; ``truth`` is None where they show two worlds."""

    family: str
    name: str
    target: OccupancyGrid
    source: OccupancyGrid
    trusted: bool
    truth: Similarity2 | None
    target_scale: float
    overlap: float
    identifiable: bool

    def digest(self) -> str:
        """Of what the merger gets, and of the truth: 16 digits of a SHA-256."""
        sha = hashlib.sha256()
        for grid in (self.target, self.source):
            frame = grid.frame
            place = (frame.resolution, frame.origin.x, frame.origin.y, frame.origin.yaw)
            sha.update(grid.occupancy().tobytes() + repr((frame.shape, np.round(place, DECIMALS).tolist())).encode())
        if self.truth is not None:
            place = (self.truth.x, self.truth.y, self.truth.yaw, self.truth.scale)
            sha.update(repr(np.round(place, DECIMALS).tolist()).encode())
        return sha.hexdigest()[:16]


def family_samples(family: str) -> dict[str, Sample]:
    """One mission of the family, sensed at all levels: a function of its name alone."""
    starts: Starts = "close" if FAMILIES[family].width >= WIDE else "random"
    mission, _ = simulate(make_world(family, SEED), MissionSettings(ROBOTS, DURATION, starts), SEED)
    places = true_places(mission)
    return {name: make_sample(mission, settings, places) for name, settings in SAMPLES}


def all_pairs(samples: dict[str, dict[str, Sample]]) -> Iterator[RegressionPair]:
    """The pairs of each family's own samples, and its first map at level 1 with that of the next family."""
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
        truth = sample.truth.pairs[target, source]
        yield RegressionPair(
            family,
            f"{name}: {target} <- {source}",
            target_grid,
            source_grid,
            sample.maps.resolutions_trusted,
            truth.target_from_source,
            sample.truth.robot(target).truth.world_from_map.scale,
            truth.footprints.overlap,
            truth.footprints.identifiability.identifiable,
        )


def _of_two_worlds(family: str, other: str, sample: Sample, other_sample: Sample) -> RegressionPair:
    target, source = sample.maps.grids[0], other_sample.maps.grids[0]
    return RegressionPair(family, f"other world: {other}", target, source, False, None, 1.0, 0.0, False)
