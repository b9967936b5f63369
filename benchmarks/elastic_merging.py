"""Walls of merged maps against the true world, merged rigidly and elastically.

``python -m benchmarks.elastic_merging --out elastic`` simulates missions of two robots, maps them by odometry and by
SLAM at each noise level, merges each pair of maps both ways, and from the logs, whose poses are optimised together. It
writes elastic.csv, one row for each pair of maps that merged, and elastic.png. It prints mean wall F1 and the mean
gains, with 95 % intervals over missions. A merged map is laid on the world where it fits best. ``--families``,
``--seeds``, ``--levels`` and ``--poses`` choose what is made.
"""

from __future__ import annotations

import argparse
import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame_perturbation import FramePerturbationRanges
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapping.robot.recorded_log import RecordedLog
from mapping.settings import MappingSettings
from mapquilt.evaluation.map_quality import align_to_world, map_quality, observed_part
from mapquilt.evaluation.statistics import mean_over_clusters
from mapquilt.logs.load_log import NamedLog
from mapquilt.merging.joint_maps import draw_jointly
from mapquilt.runs.open_world import open_world
from mapquilt.runs.sample import Sample, make_sample
from mapquilt.runs.true_footprints import TrueFootprints, true_footprints
from mapquilt.settings import SampleSettings
from mapquilt.viz.png import figure_png
from mapquilt.viz.text_table import plain_table
from merge.alignment.coarse_to_fine import pattern_search, refine
from merge.merger import merge_maps
from merge.pair.feature_cache import metres_from_prepared, prepare_map
from merge.records.result import MergedGroup
from merge.settings import MergeSettings
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.sensors.settings import SensingSettings

FAMILIES = ("office", "house", "maze", "thesis_floor", "corridor_loop", "cave")
RIGID, ELASTIC = MergeSettings(), MergeSettings(elastic=True)
SAME_SCALE = FramePerturbationRanges(1.0, 1.0)


@dataclass(frozen=True)
class Row:
    """Wall F1 of one merged map at its best fit, and placed by the truth of its maps (``scored``), both ways; the first
    from the logs, too, nan if their maps do not join; shares of doubled walls; the largest bend [m] and strain, 0 if
    the maps stayed."""

    family: str
    seed: int
    poses: str
    level: float
    f1_rigid: float
    f1_elastic: float
    f1_logs: float
    scored_rigid: float
    scored_elastic: float
    doubled_rigid: float
    doubled_elastic: float
    largest_bend: float
    strain: float

    @property
    def mission(self) -> str:
        return f"{self.family} {self.seed}"


def rows(
    families: Sequence[str], seeds: Sequence[int], poses: Sequence[str], levels: Sequence[float], duration: float
) -> Iterator[Row]:
    """Simulate each mission once, and map it by each front end at each level."""
    for seed in seeds:
        for family in families:
            world, _ = open_world(family, seed)
            mission, _ = simulate(world, MissionSettings(2, duration), seed)
            places = true_footprints(mission)
            for front_end in poses:
                for level in levels:
                    settings = SampleSettings(
                        sensing=SensingSettings(noise=level),
                        mapping=MappingSettings(poses=front_end),
                        perturbation=SAME_SCALE,
                        seed=seed,
                    )
                    row = _row(family, make_sample(mission, settings, places), places, settings)
                    if row is not None:
                        yield row


def _row(family: str, sample: Sample, places: TrueFootprints, settings: SampleSettings) -> Row | None:
    """Merge a sample both ways; None if its maps do not join."""
    rigid = merge_maps(sample.maps, RIGID)
    if len(rigid.reference_from_map) < len(sample.maps):
        return None
    known = {(pair.target, pair.source): pair for pair in rigid.pairs}
    elastic = merge_maps(sample.maps, ELASTIC, answers=known).groups[0]
    one, other = (_f1(sample, places, group) for group in (rigid.groups[0], elastic))
    bends = elastic.bends.values()
    return Row(
        family=family,
        seed=settings.seed,
        poses=settings.mapping.poses,
        level=settings.sensing.noise,
        f1_rigid=one[0],
        f1_elastic=other[0],
        f1_logs=_f1_of_logs(sample, places),
        scored_rigid=one[1],
        scored_elastic=other[1],
        doubled_rigid=rigid.groups[0].doubled_walls,
        doubled_elastic=elastic.doubled_walls,
        largest_bend=max((bend.largest_bend for bend in bends), default=0.0),
        strain=max((bend.strain for bend in bends), default=0.0),
    )


def _f1(sample: Sample, places: TrueFootprints, group: MergedGroup) -> tuple[float, float]:
    """Return the wall F1 of a merged map at its best fit, and where the truth of its maps puts it."""
    world_from_map = {name: sample.truth.robot(name).truth.world_from_map for name in group.reference_from_map}
    return _f1_at(sample.maps, world_from_map, places, group)


def _f1_of_logs(sample: Sample, places: TrueFootprints) -> float:
    """Return the wall F1, at its best fit, of the map that the logs give together; nan if their maps do not join."""
    logs = [NamedLog(log.robot, RecordedLog(log), Path(log.robot)) for log in sample.logs]
    joint = draw_jointly(logs, MappingSettings(), RIGID)
    maps = MapSet(tuple(joint.grids), tuple(joint.grids.values()), tuple("m" for _ in logs))
    merged = merge_maps(maps, RIGID)
    if len(merged.reference_from_map) < len(maps):
        return math.nan
    starts = (Similarity2.from_se2(place.truth.trajectory.pose(0)) for place in places.maps)
    return _f1_at(maps, dict(zip(maps.names, starts, strict=True)), places, merged.groups[0])[0]


def _f1_at(
    maps: MapSet, world_from_map: Mapping[str, Similarity2], places: TrueFootprints, group: MergedGroup
) -> tuple[float, float]:
    observed = observed_part(places.world, [place.footprint for place in places.maps])
    start = align_to_world(maps, world_from_map, group.reference_from_map)
    fitted = _best_fit(observed, group.merged, start)
    best, scored = (map_quality(group.merged, place, observed).f1_walls for place in (fitted, start))
    return best, scored


def _best_fit(world: OccupancyGrid, merged: OccupancyGrid, start: Similarity2) -> Similarity2:
    """Refine the rigid transform of a merged map into the world on all walls."""
    target, source = prepare_map(world), prepare_map(merged)
    to_world, to_merged = metres_from_prepared(world.frame, target), metres_from_prepared(merged.frame, source)
    cells = to_world.inverse() @ start @ to_merged
    rigid = ScaleRange(cells.scale, cells.scale)
    cells = pattern_search(target, source, refine(target, source, cells, rigid), rigid)
    return to_world @ cells @ to_merged.inverse()


def tables(measured: Sequence[Row]) -> tuple[Table, Table]:
    """Return the means by poses and noise, with intervals over missions: of bent maps, and of the logs together."""
    bent = plain_table(
        *((name, name != "poses") for name in (*_FIRST, "elastic", "gain", "95 %", "least", "doubled %"))
    )
    logs = plain_table(*((name, name != "poses") for name in (*_FIRST, "logs", "gain", "95 %", "least")))
    for poses, level in dict.fromkeys((row.poses, row.level) for row in measured):
        part = [row for row in measured if (row.poses, row.level) == (poses, level)]
        doubled = (
            100.0 * float(np.mean([getattr(row, f"doubled_{way}") for row in part])) for way in ("rigid", "elastic")
        )
        bent.add_row(poses, *_means(part, "f1_elastic"), " > ".join(f"{share:.0f}" for share in doubled))
        drawn = [row for row in part if not math.isnan(row.f1_logs)]
        if drawn:
            logs.add_row(poses, *_means(drawn, "f1_logs"))
    return bent, logs


_FIRST = ("poses", "noise", "maps", "rigid")


def _means(part: Sequence[Row], name: str) -> tuple[str, ...]:
    f1 = [getattr(row, name) for row in part]
    gains = [value - row.f1_rigid for value, row in zip(f1, part, strict=True)]
    return (
        f"{part[0].level:g}",
        str(len(part)),
        f"{np.mean([row.f1_rigid for row in part]):.3f}",
        f"{np.mean(f1):.3f}",
        f"{np.mean(gains):+.3f}",
        _interval(part, gains),
        f"{min(gains):+.3f}",
    )


def _interval(part: Sequence[Row], gains: Sequence[float]) -> str:
    interval = mean_over_clusters(gains, [row.mission for row in part], np.random.default_rng(0))
    return "-" if interval is None else f"{interval.low:+.2f} to {interval.high:+.2f}"


def picture(measured: Sequence[Row]) -> Figure:
    """Draw the wall F1 of each merged map against that of the rigid merge, by poses and noise level."""
    figure = Figure(figsize=(9.2, 4.8), layout="constrained", dpi=110)
    for axes, name, label in zip(
        figure.subplots(1, 2), ("f1_elastic", "f1_logs"), ("elastic", "from the logs, optimised together"), strict=True
    ):
        _draw(axes, measured, name, label)
    return figure


def _draw(axes: Axes, measured: Sequence[Row], name: str, label: str) -> None:
    for poses, marker in (("odometry", "o"), ("slam", "s")):
        for level, colour in zip(sorted({row.level for row in measured}), _SHADES, strict=False):
            part = [row for row in measured if (row.poses, row.level) == (poses, level)]
            if part:
                axes.plot(
                    [row.f1_rigid for row in part],
                    [getattr(row, name) for row in part],
                    marker,
                    color=colour,
                    markersize=5,
                    fillstyle="full" if poses == "odometry" else "none",
                    label=f"{poses}, noise {level:g}",
                )
    axes.plot((0.0, 1.0), (0.0, 1.0), color="#b9bec6", linewidth=1.0, zorder=0.0)
    axes.set(xlabel="wall F1, rigid", ylabel=f"wall F1, {label}", xlim=(0.0, 1.0), ylim=(0.0, 1.0), aspect="equal")
    axes.legend(frameon=False, fontsize=8)


_SHADES = ("#2a6fb0", "#4a8f4a", "#e0912f", "#b0302a")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--families", default=",".join(FAMILIES))
    parser.add_argument("--seeds", default="401,402")
    parser.add_argument("--poses", default="odometry,slam")
    parser.add_argument("--levels", default="0,1,2,3")
    parser.add_argument("--duration", type=float, default=120.0)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    measured, console = [], Console(width=80, highlight=False)
    for row in rows(
        given.families.split(","),
        [int(seed) for seed in given.seeds.split(",")],
        given.poses.split(","),
        [float(level) for level in given.levels.split(",")],
        given.duration,
    ):
        measured.append(row)
        f1 = f"{row.f1_rigid:.3f} > {row.f1_elastic:.3f}, from logs {row.f1_logs:.3f}"
        console.print(f"{row.mission} {row.poses} {row.level:g}: {f1}")
    given.out.mkdir(parents=True, exist_ok=True)
    with (given.out / "elastic.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, [each.name for each in fields(Row)])
        writer.writeheader()
        writer.writerows(asdict(row) for row in measured)
    (given.out / "elastic.png").write_bytes(figure_png(picture(measured)))
    for shown in tables(measured):
        console.print(shown)


if __name__ == "__main__":
    main()
