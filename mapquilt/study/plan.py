"""Plan of a study."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Any

from mapping.seeds import Role, check_seed, derived_seed
from mapquilt.runs.open_world import open_world
from mapquilt.settings import ExperimentConfig
from mapquilt.study.variables import SWEEPS, Variable, parse_assignment
from merge.settings import MergeSettings

MOST_VARIED = 2
Level = tuple[str, ...]
"""The value of each varied setting, as it was written."""


@dataclass(frozen=True)
class Varied:
    """A setting and its values, as they were written."""

    variable: Variable
    values: tuple[str, ...]


@dataclass(frozen=True)
class Method:
    """Choose a merging method, and the common acceptance rule or its own."""

    name: str
    as_published: bool = False

    @property
    def title(self) -> str:
        return MergeSettings(self.name, as_published=self.as_published).title


@dataclass(frozen=True)
class MissionTask:
    """One mission, at every level and by every method: the unit of parallel work."""

    index: int
    world: str
    seed: int
    sample_seed: int
    levels: tuple[tuple[Level, ExperimentConfig], ...]
    methods: tuple[Method, ...]
    cache: Path | None

    @property
    def name(self) -> str:
        return f"{self.index:03d}"


@dataclass(frozen=True)
class StudyPlan:
    """``missions`` of each of ``worlds``, at every level; pairs with an overlap below ``min_overlap`` do not count."""

    varied: tuple[Varied, ...]
    fixed: tuple[tuple[str, str], ...]
    setups: tuple[tuple[Level, ExperimentConfig], ...]
    methods: tuple[Method, ...]
    worlds: tuple[str, ...]
    missions: int
    seed: int
    min_overlap: float

    @property
    def levels(self) -> tuple[Level, ...]:
        return tuple(level for level, _ in self.setups)

    def tasks(self, cache: Path | None) -> list[MissionTask]:
        """List the missions, alternating between worlds. A seed depends only on the study's seed and the mission's
        number: neither level nor method changes it."""
        order = [world for _ in range(self.missions) for world in self.worlds]
        return [
            MissionTask(
                index,
                world,
                derived_seed(self.seed, Role.DATASET_WORLD, index),
                derived_seed(self.seed, Role.DATASET_SAMPLE, index),
                self.setups,
                self.methods,
                cache,
            )
            for index, world in enumerate(order)
        ]

    def record(self) -> dict[str, Any]:
        """Build the record of everything that the results depend on."""
        return {
            "varied": [{"name": one.variable.name, "values": list(one.values)} for one in self.varied],
            "fixed": dict(self.fixed),
            "methods": [method.title for method in self.methods],
            "worlds": list(self.worlds),
            "missions": self.missions,
            "seed": self.seed,
            "min_overlap": self.min_overlap,
        }


def plan_study(
    sweep: str | None,
    vary: Sequence[str],
    fixed: Sequence[str],
    methods: Sequence[Method],
    worlds: Sequence[str],
    missions: int,
    seed: int,
    min_overlap: float,
) -> StudyPlan:
    """Parse and check everything. Raises ``ValueError`` naming the option and its value."""
    varied = _varied(sweep, vary)
    start = _start(fixed, varied)
    levels = list(itertools.product(*(one.values for one in varied)))
    setups = tuple((level, _at(start, varied, level)) for level in levels)
    check_seed(seed)
    if missions < 1:
        raise ValueError(f"--missions {missions}: must be at least 1")
    if not 0.0 <= min_overlap <= 1.0:
        raise ValueError(f"--min-overlap {min_overlap:g}: must lie between 0 and 1")
    _refuse_doubles("--method", [method.title for method in methods])
    places = {
        (name, setup.world.width, setup.world.height)
        for _, setup in setups
        for name in (worlds if setup.world.family is None else (setup.world.family,))
    }
    for name, width, height in sorted(places, key=str):
        open_world(name, 0, width, height)
    for method in methods:
        start.merge_by(method.name, method.as_published)
    given = tuple((found.name, value) for found, value in (parse_assignment("--set", text) for text in fixed))
    return StudyPlan(varied, given, setups, tuple(methods), tuple(worlds), missions, seed, min_overlap)


def _varied(sweep: str | None, vary: Sequence[str]) -> tuple[Varied, ...]:
    if sweep is not None and sweep not in SWEEPS:
        raise ValueError(f"unknown study {sweep!r}; known are {', '.join(SWEEPS)}, and any setting by --vary")
    named = [] if sweep is None else [("", "=".join(SWEEPS[sweep]))]
    given = [("--vary", text) for text in vary]
    varied = [_values(option, text) for option, text in named + given]
    if not 1 <= len(varied) <= MOST_VARIED:
        raise ValueError(f"a study varies one setting or two, not {len(varied)}: name a sweep, or --vary NAME=V1,V2")
    _refuse_doubles("--vary", [one.variable.name for one in varied])
    return tuple(varied)


def _values(option: str, text: str) -> Varied:
    found, values = parse_assignment(option, text)
    split = tuple(values.split(","))
    if len(split) < 2:
        raise ValueError(f"{option} {text}: one value is no variation; give NAME=V1,V2")
    _refuse_doubles(option, split)
    return Varied(found, split)


def _refuse_doubles(option: str, values: Sequence[str]) -> None:
    for value in values:
        if values.count(value) > 1:
            raise ValueError(f"{option} {value}: is named twice")


def _start(fixed: Sequence[str], varied: Sequence[Varied]) -> ExperimentConfig:
    setup = ExperimentConfig()
    names = [one.variable.name for one in varied]
    for text in fixed:
        found, value = parse_assignment("--set", text)
        if found.name in names:
            raise ValueError(f"--set {text}: the study varies {found.name}")
        names.append(found.name)
        setup = _applied("--set", found, setup, value)
    return setup


def _checked(setup: ExperimentConfig) -> ExperimentConfig:
    setup.sample(0)
    if setup.mission.robots * setup.parts < 2:
        raise ValueError(f"robots is {setup.mission.robots}, must be at least 2: there is nothing to merge")
    return setup


def _at(start: ExperimentConfig, varied: Sequence[Varied], level: Level) -> ExperimentConfig:
    steps = zip(varied, level, strict=True)
    return reduce(lambda setup, step: _applied("--vary", step[0].variable, setup, step[1]), steps, start)


def _applied(option: str, found: Variable, setup: ExperimentConfig, value: str) -> ExperimentConfig:
    try:
        return _checked(found.applied(setup, value))
    except ValueError as error:
        raise ValueError(f"{option} {error}") from None
