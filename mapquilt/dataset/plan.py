"""Plan of a data set: its missions, samples and negative pairs, and the seed of each."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from mapping.grid.frame_perturbation import FramePerturbationRanges
from mapping.seeds import Role, derived_seed, stream
from mapquilt.dataset.spec import DatasetSpec, MissionsSpec, SamplesSpec
from mapquilt.leaves import with_assignments
from mapquilt.runs.open_world import is_world_file, read_world
from mapquilt.runs.true_footprints import map_names
from mapquilt.settings import COMBINED, ExperimentConfig, SampleSettings, max_yaw_of
from sim.sensors.settings import SensingSettings
from worlds.world import World

DRAWS = 100
"""Most draws for each negative pair, until it is one that was not drawn yet."""


@dataclass(frozen=True)
class SamplePlan:
    """Plan one sample: its number in the data set, and its settings."""

    index: int
    settings: SampleSettings

    @property
    def name(self) -> str:
        return f"{self.index:06d}"


@dataclass(frozen=True)
class MissionPlan:
    """Plan one mission: its world, the split of that world, and the samples made from it. Missions of one
    ``fingerprint`` are in the same world. ``world`` is that of a plan, None for a family's."""

    index: int
    missions: MissionsSpec
    seed: int
    fingerprint: str
    split: str
    samples: tuple[SamplePlan, ...]
    world: World | None = None

    @property
    def name(self) -> str:
        return f"{self.index:05d}"


@dataclass(frozen=True)
class NegativePlan:
    """Plan a pair of maps of two worlds, each named by sample and map, that must be refused."""

    target: tuple[str, str]
    source: tuple[str, str]
    split: str


@dataclass(frozen=True)
class DatasetPlan:
    missions: tuple[MissionPlan, ...]
    negatives: tuple[NegativePlan, ...]

    @property
    def samples(self) -> int:
        return sum(len(mission.samples) for mission in self.missions)


def plan_dataset(spec: DatasetSpec, worlds: Mapping[str, World] = MappingProxyType({})) -> DatasetPlan:
    """Plan a data set; ``worlds`` are those of the plans that it carries, by the path in the specification.

    Each seed is a function of the root seed and the item's number, unless the specification lists seeds.

    Worlds are compared by their content, because a floor plan and some families give the same world at every seed: all
    missions in a world belong to one split. Raises ``ValueError`` naming a world that cannot be opened.
    """
    combinations = _combinations(spec.samples, spec.seed)
    missions: list[MissionPlan] = []
    split_of: dict[str, str] = {}
    for family in spec.missions:
        first = len(missions)
        seeds = _seeds(spec.seed, family, first)
        place = worlds.get(family.world)
        contents = _fingerprints(family, seeds) if place is None else [place.fingerprint] * family.count
        new = [each for each in dict.fromkeys(contents) if each not in split_of]
        split_of.update(zip(new, _splits(spec, len(new)), strict=True))
        for number, (seed, world) in enumerate(zip(seeds, contents, strict=True)):
            index = len(missions)
            samples = tuple(
                SamplePlan(
                    k, combinations[k % len(combinations)].sample(derived_seed(spec.seed, Role.DATASET_SAMPLE, k))
                )
                for k in range(index * spec.samples.per_mission, (index + 1) * spec.samples.per_mission)
            )
            mission = family.of_mission(number)
            missions.append(MissionPlan(index, mission, seed, world, split_of[world], samples, place))
    return DatasetPlan(tuple(missions), _negatives(spec, missions))


def _seeds(root: int, family: MissionsSpec, first: int) -> list[int]:
    """Return the seeds of a group's missions: those listed, or derived from the root and the number of the mission."""
    if family.seeds is not None:
        return [family.seeds[0] + number for number in range(family.count)]
    return [derived_seed(root, Role.DATASET_WORLD, first + number) for number in range(family.count)]


def _fingerprints(family: MissionsSpec, seeds: Sequence[int]) -> list[str]:
    """Return the fingerprint of the world of each seed."""
    different = seeds[:1] if is_world_file(family.world) else seeds
    found = [
        read_world(family.world, seed, family.width, family.height, family.plan)[0].fingerprint for seed in different
    ]
    return found * (len(seeds) // len(different))


def _combinations(samples: SamplesSpec, seed: int) -> list[ExperimentConfig]:
    """List every combination of the values once, shuffled so that the first few differ in all values."""
    changes = [[f"{name}={value}" for value in values] for name, values in samples.set.items()]
    every = [
        with_assignments(
            ExperimentConfig(
                sensing=SensingSettings(noise),
                mapping=samples.mapping(poses, resolution, model),
                perturbation=FramePerturbationRanges(*scale, max_yaw_of(rotation), offset),
                parts=parts,
            ),
            "set",
            assignments,
            COMBINED,
        )
        for noise, poses, scale, parts, resolution, model, rotation, offset in itertools.product(
            samples.noise,
            samples.poses,
            samples.scale,
            samples.parts,
            samples.resolution,
            samples.sensor_model,
            samples.max_rotation,
            samples.max_offset,
        )
        for assignments in itertools.product(*changes)
    ]
    return [every[k] for k in stream(seed, Role.DATASET_ORDER).permutation(len(every))]


def _splits(spec: DatasetSpec, count: int) -> list[str]:
    """Assign a split to each mission of a family: shares by largest remainder, evenly interleaved."""
    total = sum(spec.splits.values())
    order = []
    for name, share in spec.splits.items():
        wanted = count * share / total
        order += [((k + 0.5) / max(wanted, 1e-9), name) for k in range(int(np.ceil(wanted)))]
    return [name for _, name in sorted(order, key=lambda one: one[0])[:count]]


def _negatives(spec: DatasetSpec, missions: Sequence[MissionPlan]) -> tuple[NegativePlan, ...]:
    """Draw different pairs of maps of two worlds of one split: first of any two worlds, then of two that are alike."""
    rng = stream(spec.seed, Role.DATASET_NEGATIVES)
    found: dict[NegativePlan, None] = {}
    if spec.other_worlds:
        by_split = {split: [each for each in missions if each.split == split] for split in spec.splits}
        usable = [split for split, members in by_split.items() if len({each.fingerprint for each in members}) >= 2]
        if not usable:
            raise ValueError("other_worlds needs a split with at least two different worlds")
        shares = np.array([len(by_split[split]) for split in usable], dtype=float)
        shares /= shares.sum()
        _add_different(
            found,
            "other_worlds",
            spec.other_worlds,
            lambda: _of_two_worlds(rng, by_split[_chosen(rng, usable, shares)]),
        )
    if spec.alike_worlds:
        alike = [(each, others) for each in missions if (others := _alike(each, missions))]
        if not alike:
            raise ValueError("alike_worlds needs a split with two different worlds of one family or building")
        _add_different(found, "alike_worlds", spec.alike_worlds, lambda: _of_alike_worlds(rng, alike))
    return tuple(found)


def _add_different(found: dict[NegativePlan, None], key: str, count: int, draw: Callable[[], NegativePlan]) -> None:
    """Add ``count`` pairs that are not there yet. Raises ``ValueError`` if there seem to be fewer."""
    end = len(found) + count
    for _ in range(DRAWS * count):
        found[draw()] = None
        if len(found) == end:
            return
    raise ValueError(f"{key} is {count}, but there are hardly more than {count - end + len(found)} different pairs")


def _chosen(rng: np.random.Generator, splits: Sequence[str], shares: NDArray[np.float64]) -> str:
    return splits[int(rng.choice(len(splits), p=shares))]


def _of_two_worlds(rng: np.random.Generator, members: Sequence[MissionPlan]) -> NegativePlan:
    first, second = (int(k) for k in rng.choice(len(members), 2, replace=False))
    target = members[first]
    in_order = (*members[second:], *members[:second])
    source = next(each for each in in_order if each.fingerprint != target.fingerprint)
    return NegativePlan(_any_map(rng, target), _any_map(rng, source), target.split)


def _alike(mission: MissionPlan, missions: Sequence[MissionPlan]) -> list[MissionPlan]:
    """List the missions of the same split in another world of the same family or building."""
    return [
        each
        for each in missions
        if each.missions.kind == mission.missions.kind
        and each.split == mission.split
        and each.fingerprint != mission.fingerprint
    ]


def _of_alike_worlds(
    rng: np.random.Generator, alike: Sequence[tuple[MissionPlan, Sequence[MissionPlan]]]
) -> NegativePlan:
    target, others = alike[int(rng.integers(len(alike)))]
    source = others[int(rng.integers(len(others)))]
    return NegativePlan(_any_map(rng, target), _any_map(rng, source), target.split)


def _any_map(rng: np.random.Generator, mission: MissionPlan) -> tuple[str, str]:
    sample = mission.samples[int(rng.integers(len(mission.samples)))]
    names = map_names(mission.missions.robots, sample.settings.parts)
    return sample.name, names[int(rng.integers(len(names)))]
