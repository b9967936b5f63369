"""Robots' maps against drawn floor plans: is the place right, is it accepted, is it the right plan of ten.

``python -m benchmarks.plans --data plans_data --out plans`` simulates twenty missions of one robot (once, into
``plans_data``), maps them by SLAM at noise 1, and draws the plan of each world ten times, twice in each style, at a
scale that is not told. It writes pairs.csv, one row for each map and plan, and plans.png, and prints the rates.
``--drawings N`` draws N plans of each world, ``--trials N`` asks N times for the plan of each map among ten, the nine
others of other worlds of the family, ``--worlds N`` takes the first N missions.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.frame_perturbation import FramePerturbationRanges
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import load_map
from mapping.seeds import Role, derived_seed
from mapquilt.api import simulate
from mapquilt.evaluation.statistics import Share
from mapquilt.evaluation.transform_error import RIGHT, RIGHT_PLACE, transform_error
from mapquilt.location.locate import LocationSettings, Placement, locate
from mapquilt.location.plan_picture import PlanPicture
from mapquilt.runs.folder import TRUTH_FILE, is_run, map_files
from mapquilt.runs.truth_file import load_truth
from mapquilt.settings import SampleSettings
from mapquilt.viz.png import figure_png
from mapquilt.viz.text_table import plain_table
from worlds.drafting.drafting import DraftedPlan, draft_plan
from worlds.drafting.style import STYLES
from worlds.families.registry import make_world
from worlds.importing.drawn_walls import find_walls, plan_grid

DURATIONS = {"house": 150.0, "maze": 240.0}
"""Mission time [s] of families that are explored sooner than in 300 s."""
MISSIONS = tuple(
    (family, 201 + index)
    for index, families in enumerate(
        (
            ("office", "house", "hospital", "corridor_loop", "maze", "thesis_floor"),
            ("office", "house", "hospital", "corridor_loop", "maze", "thesis_floor"),
            ("office", "house", "hospital", "maze"),
            ("office", "house"),
            ("office", "house"),
        )
    )
    for family in families
)
"""Families with walls, and seeds. A warehouse without its racks is an empty hall, caves and outdoors have no plan."""
OTHERS = 9
"""Plans of other worlds in a trial."""


@dataclass(frozen=True)
class Row:
    """One map against one plan: the verdict by this plan alone, that of the merger, and the errors.

    Errors, only for the plan of the map's world, are rotation [degrees], scale [percent] and displacement as a share of
    the plan's diagonal. Beside them are the evidence of the match, and the cells of the plan's wall faces that the map
    confirmed and denied. ``trial`` numbers the searches among ten plans of a mission, -1 outside of them; ``rank`` is
    that of the plan in its search, ``named`` the verdict of it. Processor time [s] of preparation and matching.
    """

    family: str
    seed: int
    plan_seed: int
    style: str
    drawing: int
    trial: int
    prepared: bool
    accepted: bool
    confidence: float
    merger_accepted: bool
    merger_confidence: float
    score: float
    second_best: float
    local_violation: float
    conflict_ratio: float
    precision: float
    inlier_length: float
    normal_isotropy: float
    overlap: float
    confirmed: int
    denied: int
    rotation_deg: float
    scale_percent: float
    displacement: float
    right: bool
    near: bool
    rank: int
    named: bool
    reason: str
    prepare_s: float
    match_s: float

    @property
    def own(self) -> bool:
        """True if the plan is that of the map's world."""
        return self.seed == self.plan_seed


@dataclass(frozen=True, eq=False)
class Scan:
    """The map of a mission, and its true ``world_from_map``."""

    family: str
    seed: int
    grid: OccupancyGrid
    world_from_map: Similarity2


@dataclass(frozen=True, eq=False)
class Drawing:
    """A drawn plan: the seed of its world, its style and its own seed, and what was prepared, None if no walls were
    found, in ``seconds``."""

    world_seed: int
    style: str
    seed: int
    drawn: DraftedPlan
    plan: PlanPicture | None
    seconds: float


def load_scan(data: Path, family: str, seed: int) -> Scan:
    """Read the map of a mission; simulate it first if it is not there."""
    run = data / f"{family}-{seed}"
    if not is_run(run):
        honest = FramePerturbationRanges(scale_low=1.0, scale_high=1.0)
        sampling = SampleSettings(perturbation=honest, seed=seed)
        simulate(family, robots=1, seed=seed, duration=DURATIONS.get(family, 300.0), sampling=sampling, out=run)
    (path,) = map_files(run).values()
    return Scan(family, seed, load_map(path).grid, load_truth(run / TRUTH_FILE).robots[0].truth.world_from_map)


def draw(family: str, world_seed: int, style: str, seed: int) -> Drawing:
    """Draw the plan of a world and find its walls."""
    drawn = draft_plan(make_world(family, world_seed), style, seed)
    start = time.process_time()
    try:
        walls = find_walls(drawn.grey)
    except ValueError:
        return Drawing(world_seed, style, seed, drawn, None, time.process_time() - start)
    seconds = time.process_time() - start
    name = f"{family}-{world_seed}-{style}-{seed}"
    return Drawing(world_seed, style, seed, drawn, PlanPicture(name, Path(f"{name}.png"), drawn.grey, walls), seconds)


def pair_rows(scan: Scan, drawings: int) -> Iterator[Row]:
    """Match a map to plans of its own world, each by itself."""
    for number, style in zip(range(drawings), itertools.cycle(STYLES)):
        drawing = draw(scan.family, scan.seed, style, derived_seed(scan.seed, Role.DRAFTING, number))
        yield from _rows(scan, [drawing], trial=-1)


def trial_rows(scan: Scan, trials: int) -> Iterator[Row]:
    """Search for the plan of a map among ten."""
    for trial in range(trials):
        drawings = []
        for other in range(OTHERS + 1):
            seed = derived_seed(scan.seed, Role.DRAFTING, 1000 + 100 * trial + other)
            world_seed = scan.seed + (1000 * (trial + 1) + other if other else 0)
            drawings.append(draw(scan.family, world_seed, tuple(STYLES)[seed % len(STYLES)], seed))
        yield from _rows(scan, drawings, trial)


def _rows(scan: Scan, drawings: Sequence[Drawing], trial: int) -> list[Row]:
    plans = [one.plan for one in drawings if one.plan is not None]
    start = time.process_time()
    ranked = locate(scan.grid, plans) if plans else ()
    seconds = (time.process_time() - start) / len(drawings)
    ranks = {one.plan.name: rank for rank, one in enumerate(ranked)}
    rows = []
    for drawing in drawings:
        rank = OTHERS if drawing.plan is None else ranks[drawing.plan.name]
        placement = None if drawing.plan is None else ranked[rank]
        rows.append(_row(scan, drawing, trial, rank, placement, seconds))
    return rows


def _row(scan: Scan, drawing: Drawing, trial: int, rank: int, placement: Placement | None, seconds: float) -> Row:
    errors = (np.nan, np.nan, np.nan)
    right = near = False
    if placement is not None and placement.plan_from_scan is not None and drawing.world_seed == scan.seed:
        target = plan_grid(placement.plan.walls, 1.0, LocationSettings.cells_per_wall)
        error = transform_error(target, scan.grid, true_placement(scan, drawing.drawn), placement.plan_from_scan)
        shift = np.nan if error.displacement_of_diagonal is None else error.displacement_of_diagonal
        errors = (error.rotation_deg, error.scale_percent, shift)
        right, near = RIGHT.holds(error), RIGHT_PLACE.holds(error)
    evidence = None if placement is None else placement.answer.evidence
    return Row(
        family=scan.family,
        seed=scan.seed,
        plan_seed=drawing.world_seed,
        style=drawing.style,
        drawing=drawing.seed,
        trial=trial,
        prepared=placement is not None,
        accepted=placement is not None and placement.verdict.reason is None,
        confidence=0.0 if placement is None else placement.verdict.confidence,
        merger_accepted=placement is not None and placement.answer.accepted,
        merger_confidence=0.0 if placement is None else placement.answer.confidence,
        score=0.0 if evidence is None else evidence.score,
        second_best=0.0 if evidence is None else evidence.second_best_score,
        local_violation=np.nan if evidence is None else evidence.local_violation or 0.0,
        conflict_ratio=np.nan if evidence is None else evidence.conflict_ratio or 0.0,
        precision=0.0 if evidence is None else evidence.precision_probability,
        inlier_length=0.0 if evidence is None else evidence.inlier_length_cells,
        normal_isotropy=0.0 if evidence is None else evidence.normal_isotropy,
        overlap=0.0 if evidence is None else evidence.overlap,
        confirmed=0 if placement is None else placement.walls.confirmed,
        denied=0 if placement is None else placement.walls.denied,
        rotation_deg=errors[0],
        scale_percent=errors[1],
        displacement=errors[2],
        right=right,
        near=near,
        rank=rank,
        named=placement is not None and placement.reason is None,
        reason="no walls" if placement is None else placement.verdict.reason or "",
        prepare_s=drawing.seconds,
        match_s=seconds,
    )


def true_placement(scan: Scan, drawn: DraftedPlan) -> Similarity2:
    """Return the true transform of a map onto a plan, in pixels from its lower left corner, y up."""
    frame: GridFrame = drawn.frame
    origin = frame.origin
    return Similarity2(origin.x, origin.y, origin.yaw, frame.resolution).inverse() @ scan.world_from_map


def rates(rows: Sequence[Row]) -> Table:
    """Tabulate the rates by style and by family, and of all."""
    table = plain_table(
        ("plans", False), ("pairs", True), ("right", True), ("right and\naccepted", True), ("wrong\naccepted", True)
    )
    pairs = [row for row in rows if row.trial < 0]
    groups = {"all": pairs}
    groups |= {style: [row for row in pairs if row.style == style] for style in STYLES}
    groups |= {name: [row for row in pairs if row.family == name] for name, _ in MISSIONS}
    for name, part in groups.items():
        if part:
            right, accepted = _share(row.right for row in part), _share(row.right and row.accepted for row in part)
            wrong = sum(row.accepted and not row.right for row in part)
            table.add_row(name, str(len(part)), right, accepted, str(wrong))
    trials = [row for row in rows if row.trial >= 0]
    own, others = [row for row in trials if row.own], [row for row in trials if not row.own]
    notes = []
    if own:
        first = _share(row.rank == 0 for row in own)
        named = _share(row.named and row.right for row in own)
        notes.append(f"right plan of {OTHERS + 1}, {len(own)} searches: first {first},")
        notes.append(f"named at the right place {named}")
        false = sum(row.accepted for row in others), sum(row.named for row in others)
        notes.append(f"other plans accepted alone {false[0]}, named {false[1]}, of {len(others)}")
    merger = (
        sum(row.merger_accepted and row.right for row in pairs),
        sum(row.merger_accepted and not row.right for row in pairs),
    )
    if pairs:
        notes.append(f"the merger alone accepts {merger[0]} right and {merger[1]} wrong of {len(pairs)}")
    seconds = np.median([row.prepare_s for row in rows]), np.median([row.match_s for row in rows])
    notes.append(f"median processor time: preparation {seconds[0]:.2f} s, match {seconds[1]:.2f} s")
    table.caption = "\n".join(notes)
    return table


def _share(flags: Iterable[bool]) -> str:
    """Format a share in per cent, with its 95 % interval."""
    share = Share.counted(list(flags))
    low, high = 100.0 * share.interval.low, 100.0 * share.interval.high
    return f"{100.0 * share.value:.1f} % ({low:.1f} to {high:.1f})"


def picture(rows: Sequence[Row]) -> Figure:
    """Draw the confidences of right, wrong and other plans' answers."""
    figure = Figure(figsize=(8, 3.2), layout="constrained", dpi=110)
    axes = figure.subplots()
    bins = np.linspace(0.0, 1.0, 41).tolist()
    parts = (
        ("own plan, right", "#0072B2", [row.confidence for row in rows if row.own and row.right]),
        ("own plan, wrong", "#c1121f", [row.confidence for row in rows if row.own and not row.right]),
        ("other plan", "#8b949e", [row.confidence for row in rows if not row.own]),
    )
    for name, colour, values in parts:
        axes.hist(values, bins=bins, label=name, color=colour, alpha=0.7)
    axes.set(xlabel="confidence by the plan alone", ylabel="plans", yscale="symlog")
    axes.legend(frameon=False)
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--data", type=Path, default=Path("plans_data"), help="folder of the missions")
    parser.add_argument("--out", type=Path, default=Path("plans"))
    parser.add_argument("--worlds", type=int, default=len(MISSIONS))
    parser.add_argument("--drawings", type=int, default=2 * len(STYLES))
    parser.add_argument("--trials", type=int, default=2)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    measured: list[Row] = []
    with (options.out / "pairs.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [each.name for each in fields(Row)])
        writer.writeheader()
        for family, seed in MISSIONS[: options.worlds]:
            scan = load_scan(options.data, family, seed)
            for row in itertools.chain(pair_rows(scan, options.drawings), trial_rows(scan, options.trials)):
                writer.writerow(asdict(row))
                file.flush()
                measured.append(row)
    (options.out / "plans.png").write_bytes(figure_png(picture(measured)))
    Console(width=80, highlight=False).print(rates(measured))


if __name__ == "__main__":
    main()
