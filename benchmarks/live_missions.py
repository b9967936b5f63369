"""Replay simulated missions through a live merge: jumps, wrong joins, and the time to the first right join.

``python -m benchmarks.live_missions --missions 200 --out live_missions`` simulates missions of all families of worlds,
gives the maps to a live merge as they grow, in mission time, and compares every pose that it publishes with the truth.
The same maps go to the recipe of m-explore (``stitching`` as published) at the same times. Each mission is a line of
missions.jsonl at once; the same command goes on where it was interrupted. Then it prints the table, and draws
first_join.png. ``--first`` is the seed of the first mission.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from benchmarks.live_team import LiveTeam, MissionPlan, PairError, simulate_team
from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.truth import MIN_COMMON_CELLS
from mapquilt.cli.tables import print_table
from mapquilt.evaluation.statistics import Share
from mapquilt.jobs.progress import count_progress
from mapquilt.live.live_merger import LiveMerger, LiveState
from mapquilt.live.placement import displacement
from mapquilt.live.received_map import grid_of
from mapquilt.live.settings import LiveSettings
from mapquilt.viz.png import figure_png
from mapquilt.viz.text_table import plain_table
from merge.pair.feature_cache import FeatureCache
from merge.pair.pipeline import match
from merge.pair.task import PairTask
from merge.settings import MergeSettings

JUMP_METRES, JUMP_DEGREES = 0.25, 2.0


@dataclass
class Wrong:
    """A join that is wrong by the score's tolerance, from ``since`` [s] until it is mended or taken back.

    ``until`` is None at the end of the mission. ``metres`` and ``degrees`` are its largest errors, ``elsewhere`` says
    that it is not even in the right place; ``residual`` [m] is that of the truth then.
    """

    robot: str
    since: float
    until: float | None = None
    metres: float = 0.0
    degrees: float = 0.0
    residual: float = 0.0
    elsewhere: bool = False

    def widen(self, error: PairError) -> None:
        """Keep the largest error."""
        metres = error.error.displacement_m
        self.elsewhere |= error.elsewhere
        if metres is not None and metres >= self.metres:
            self.metres, self.degrees, self.residual = metres, error.error.rotation_deg, error.residual


@dataclass
class Outcome:
    """What a live merge of one mission published.

    ``jumps`` [s, robot, m, degrees] are moves between two publications of two maps or more, ``returns`` those of a map
    that was taken back before; ``frames`` are the times at which the merged frame was fixed. ``first_right`` [s] is the
    time of the first right join, None without, ``explore_right`` that of m-explore, ``explore_wrong`` that of its first
    wrong one. ``joined`` maps of ``robots`` at the end, of which ``joinable`` share walls with another one.
    """

    plan: dict[str, Any]
    robots: int
    joinable: int = 0
    joined: int = 0
    jumps: list[tuple[float, str, float, float]] = field(default_factory=list)
    returns: list[tuple[float, str, float, float]] = field(default_factory=list)
    frames: list[tuple[float, str]] = field(default_factory=list)
    wrong: list[Wrong] = field(default_factory=list)
    first_right: float | None = None
    explore_right: float | None = None
    explore_wrong: float | None = None
    events: list[tuple[float, str]] = field(default_factory=list)
    seconds: float = 0.0
    simulated_seconds: float = 0.0


def measure(team: LiveTeam, settings: LiveSettings = LiveSettings()) -> Outcome:
    """Replay a mission through a live merge, and compare what it publishes with the truth."""
    merger, outcome = LiveMerger(settings), Outcome(asdict(team.plan), team.plan.robots)
    last: dict[str, Similarity2] = {}
    gone: set[str] = set()
    standing: dict[str, Wrong] = {}
    start = time.process_time()
    for now, message in team.messages:
        state = merger.update([message], now)
        outcome.events += [(now, event) for event in state.events if "heard for the first" not in event]
        poses = state.poses if len(state.poses) > 1 else {}
        frames = [name for name in poses if state.placements[name].holds_frame]
        if frames and (not outcome.frames or outcome.frames[-1][1] != frames[0]):
            outcome.frames.append((now, frames[0]))
        for name, pose in poses.items():
            if name in last:
                shift, turn = displacement(last[name], pose, state.robots[name].middle)
                if shift > JUMP_METRES or math.degrees(turn) > JUMP_DEGREES:
                    (outcome.returns if name in gone else outcome.jumps).append((now, name, shift, math.degrees(turn)))
        gone = (gone | last.keys()) - poses.keys()
        last |= poses
        errors = _errors(team, state, now)
        for name in standing.keys() - {name for name, error in errors.items() if not error.right}:
            standing.pop(name).until = now
        for name, error in errors.items():
            if error.right:
                outcome.first_right = now if outcome.first_right is None else outcome.first_right
            elif error.wrong and name not in standing:
                standing[name] = Wrong(name, now)
                outcome.wrong.append(standing[name])
            if error.wrong:
                standing[name].widen(error)
    outcome.seconds = time.process_time() - start
    outcome.joined = len(merger.state.poses)
    end = team.messages[-1][0]
    names = list(team.robots)
    shared = [pair for pair in combinations(names, 2) if team.shared_cells(pair, end) >= MIN_COMMON_CELLS]
    outcome.joinable = len({name for pair in shared for name in pair})
    return outcome


def _errors(team: LiveTeam, state: LiveState, now: float) -> dict[str, PairError]:
    """Return the error of each published pose, against the map that holds the frame or, if they share no wall, against
    the map that shares most with it."""
    grids = {name: robot.grid for name, robot in state.robots.items() if robot.grid is not None}
    reference = next((name for name, each in state.placements.items() if each.holds_frame), None)
    errors: dict[str, PairError] = {}
    for name in state.poses:
        others = [each for each in state.poses if each != name]
        if name == reference or not others:
            continue
        shared = {each: team.shared_cells((each, name), now) for each in others}
        target = (
            reference if reference and shared[reference] >= MIN_COMMON_CELLS else max(others, key=shared.__getitem__)
        )
        errors[name] = team.error(grids, state.poses, (target, name), now)
    return errors


def explore_joins(team: LiveTeam, until: float = math.inf) -> tuple[float | None, float | None]:
    """Return the times [s] at which the recipe of m-explore first joins two maps right, and wrong, if it does.

    Its package estimates all pairs anew at each update; any pair counts that it accepts.
    """
    settings = MergeSettings(method="stitching", as_published=True)
    cache, grids = FeatureCache(settings.preparation), dict[str, OccupancyGrid]()
    right: float | None = None
    wrong: float | None = None
    for now, message in team.messages:
        grids[message.robot] = grid_of(message).cropped()
        for other in [name for name in grids if name != message.robot]:
            names = (other, message.robot)
            pair = PairTask(names, (grids[other], grids[message.robot]), ("m", "m"), ScaleRange.known(), settings, 0)
            answer = match(pair, cache)
            if not answer.accepted or answer.target_from_source is None:
                continue
            poses = {other: Similarity2.identity(), message.robot: answer.target_from_source}
            error = team.error(grids, poses, names, now)
            if error.right:
                return now, wrong
            wrong = now if wrong is None and error.wrong else wrong
    return right, wrong


def table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Return the shares with Wilson's intervals, and the times."""
    shown = plain_table(("measured", False), ("count", True), ("share", True), ("95 %", True), ("asked", True))

    def share(title: str, flags: Sequence[bool], asked: str = "") -> None:
        if flags:
            found = Share.counted(flags)
            low, high = 100.0 * found.interval.low, 100.0 * found.interval.high
            shown.add_row(
                title, f"{found.count} of {found.of}", f"{100.0 * found.value:.1f} %", f"{low:.1f} to {high:.1f}", asked
            )

    share("merged frame moved after a join", [bool(row["jumps"]) for row in rows], "0")
    share("taken back, then joined elsewhere", [bool(row["returns"]) for row in rows])
    share("merged frame fixed anew", [len(row["frames"]) > 1 for row in rows])
    share("a wrong join", [bool(row["wrong"]) for row in rows])
    share("one in a wrong place", [any(each["elsewhere"] for each in row["wrong"]) for row in rows])
    share("a wrong join at the end", [_stands(row, elsewhere=False) for row in rows], "0")
    share("one in a wrong place at the end", [_stands(row, elsewhere=True) for row in rows], "0")
    possible = [row for row in rows if row["joinable"] > 1]
    share("a right join, live", [row["first_right"] is not None for row in possible])
    share("a right join, m-explore", [row["explore_right"] is not None for row in possible])
    share("a wrong one before, m-explore", [row["explore_wrong"] is not None for row in rows])
    maps = [index < row["joined"] for row in rows for index in range(max(row["joinable"], row["joined"]))]
    share("joinable maps, joined at the end", maps)
    stood = sorted(each["until"] - each["since"] for row in rows for each in row["wrong"] if each["until"] is not None)
    lines = [f"{len(rows)} missions, {sum(row['robots'] for row in rows)} robots"]
    if stood:
        lines.append(f"wrong joins that ended stood {np.median(stood):.0f} s in the median, {stood[-1]:.0f} s at most")
    both = [row for row in possible if row["first_right"] is not None and row["explore_right"] is not None]
    if both:
        live, explore = (float(np.median([row[key] for row in both])) for key in ("first_right", "explore_right"))
        lines.append(f"median time to the first right join, where both have one: {live:.0f} s and {explore:.0f} s")
    shown.caption = "\n".join(lines)
    return shown


def _stands(row: Mapping[str, Any], elsewhere: bool) -> bool:
    return any(each["until"] is None and (each["elsewhere"] or not elsewhere) for each in row["wrong"])


def picture(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw the share of missions with a right join against mission time, for both."""
    possible = [row for row in rows if row["joinable"] > 1]
    figure = Figure(figsize=(6.0, 3.6), layout="constrained", dpi=110)
    axes = figure.subplots()
    longest = max((row["plan"]["duration"] for row in possible), default=1.0)
    for key, label, colour in (("first_right", "mapquilt live", "#2a6fb0"), ("explore_right", "m-explore", "#e0912f")):
        times = sorted(row[key] for row in possible if row[key] is not None)
        shares = 100.0 * np.arange(len(times) + 1) / max(1, len(possible))
        axes.step([0.0, *times, longest], [*shares, shares[-1]], where="post", color=colour, label=label)
    axes.set(xlabel="mission time [s]", ylabel="missions with a right join [%]", xlim=(0.0, longest), ylim=(0.0, 100.0))
    axes.legend(frameon=False, loc="upper left")
    return figure


def run(out: Path, seeds: Sequence[int]) -> list[dict[str, Any]]:
    """Measure the missions that are not in missions.jsonl yet, and return the rows of all of them."""
    out.mkdir(parents=True, exist_ok=True)
    path = out / "missions.jsonl"
    lines = path.read_text().splitlines() if path.exists() else []
    rows = {row["plan"]["seed"]: row for row in map(json.loads, lines)}
    missing = [seed for seed in seeds if seed not in rows]
    with count_progress("missions") as on_progress, path.open("a") as file:
        for done, seed in enumerate(missing, start=len(seeds) - len(missing)):
            on_progress(done, len(seeds))
            before = time.process_time()
            team = simulate_team(MissionPlan.drawn(seed))
            simulated = time.process_time() - before
            outcome = measure(team)
            right, wrong = explore_joins(team)
            outcome = replace(outcome, explore_right=right, explore_wrong=wrong, simulated_seconds=simulated)
            line = json.dumps(asdict(outcome))
            file.write(line + "\n")
            file.flush()
            rows[seed] = json.loads(line)
    return [rows[seed] for seed in seeds]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--missions", type=int, default=200)
    parser.add_argument("--first", type=int, default=1000)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    rows = run(given.out, range(given.first, given.first + given.missions))
    (given.out / "first_join.png").write_bytes(figure_png(picture(rows)))
    print_table(table(rows))


if __name__ == "__main__":
    main()
