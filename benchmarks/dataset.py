"""Data sets in ``make bench``: processor time of each step from mission to sample, on one worker."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from types import ModuleType
from unittest.mock import patch

from rich import box
from rich.console import Console
from rich.table import Table

from mapping.ground_truth import truth
from mapping.ground_truth.coarse_footprint import CoarseFootprint
from mapquilt.dataset import group
from mapquilt.dataset.plan import MissionPlan, plan_dataset
from mapquilt.dataset.spec import DatasetSpec, MissionsSpec, load_spec
from mapquilt.runs import sample, true_footprints

FAMILIES = ("office", "warehouse", "hospital", "cave")
WORK = ("simulating", "sensing", "mapping", "disguising")
REST_BOUND = 0.10

STEPS: tuple[tuple[str, ModuleType | type, str], ...] = (
    ("simulating", group, "_simulate"),
    ("sensing", sample, "sense"),
    ("mapping", sample, "map_log"),
    ("disguising", sample, "perturb_frame"),
    ("truth: footprints", true_footprints, "true_raster"),
    ("truth: footprints", true_footprints, "_true_map"),
    ("truth: second placements", CoarseFootprint, "of"),
    ("truth: second placements", truth, "identifiability"),
    ("truth: beam endpoints", sample, "beam_endpoints"),
    ("truth: fits", sample, "map_truth"),
    ("truth: fits", sample, "_pair_truths"),
    ("files: mission", group, "_made_mission"),
    ("files: maps, logs, truth", group, "fill_run"),
    ("files: previews", group, "preview_png"),
    ("files: hashes", group, "_hashes"),
)
"""Name of each step, and its functions, by the module that calls them. A nested step counts only as itself, and the
time outside of all steps as all else."""

Seconds = dict[str, float]


class Clock:
    """Measure the processor time of this process by step [s], with each moment counted for the innermost step."""

    def __init__(self) -> None:
        self.seconds: Seconds = defaultdict(float)
        self._running = ["all else"]
        self._since = time.process_time()

    def _turn(self) -> None:
        now = time.process_time()
        self.seconds[self._running[-1]] += now - self._since
        self._since = now

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        self._turn()
        self._running.append(name)
        try:
            yield
        finally:
            self._turn()
            self._running.pop()

    def timed(self, name: str, function: Callable[..., object]) -> Callable[..., object]:
        def call(*given: object, **named: object) -> object:
            with self.step(name):
                return function(*given, **named)

        return call


def bench_dataset() -> None:
    """Print the time split of the built-in specification ``standard``, with one mission per family."""
    missions = tuple(MissionsSpec(world=family, count=1) for family in FAMILIES)
    plans = _plans(missions)
    measure(_plans((MissionsSpec(world=FAMILIES[0], count=1, robots=2, duration=5.0),))[0])  # compiled, loaded, warm
    split: Seconds = defaultdict(float)
    for plan in plans:
        for name, seconds in measure(plan).items():
            split[name] += seconds
    samples = sum(len(plan.samples) for plan in plans)
    _print_split(split, f"making a data set: {', '.join(FAMILIES)}; {samples} samples of {len(plans)} missions")


def measure(plan: MissionPlan) -> Seconds:
    """Return the processor time [s] by step for the samples of one mission."""
    clock = Clock()
    with ExitStack() as stack:
        for name, module, function in STEPS:
            stack.enter_context(patch.object(module, function, clock.timed(name, getattr(module, function))))
        with clock.step("all else"):
            made = group.make_group(plan)
    failures = [one.failure for one in (made.mission, *made.samples.values()) if one.failure is not None]
    if failures:
        raise RuntimeError(f"bench_dataset: {failures[0]}")
    return clock.seconds


def _plans(missions: tuple[MissionsSpec, ...]) -> tuple[MissionPlan, ...]:
    standard = load_spec("standard")
    spec = DatasetSpec(name="bench", seed=standard.seed, missions=missions, samples=standard.samples)
    return plan_dataset(spec).missions


def _print_split(split: Seconds, title: str) -> None:
    table = Table(title=title, box=box.SIMPLE_HEAD, title_justify="left", pad_edge=False, caption_justify="left")
    for index, column in enumerate(("step", "s", "share")):
        table.add_column(column, justify="right" if index else "left")
    whole = sum(split.values())
    for name in dict.fromkeys([*(step for step, *_ in STEPS), "all else"]):
        table.add_row(name, f"{split[name]:.2f}", f"{100 * split[name] / whole:.1f} %")
    rest = whole - sum(split[name] for name in WORK)
    table.add_row("all", f"{whole:.2f}", "100 %")
    table.caption = (
        f"outside {', '.join(WORK[:-1])} and {WORK[-1]}: {100 * rest / whole:.1f} %, at most {100 * REST_BOUND:g} %"
    )
    Console(highlight=False).print(table)


if __name__ == "__main__":
    bench_dataset()
