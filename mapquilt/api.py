"""The Python interface: one function per task, on files or on records in memory."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet

if TYPE_CHECKING:
    from mapquilt.benchmark.results import BenchmarkResults
    from mapquilt.evaluation.evaluated_pair import EvaluatedPair
    from mapquilt.runs.sample import Sample
    from mapquilt.runs.truth_file import RunTruth
    from mapquilt.settings import SampleSettings
    from merge.records.result import MergeResult
    from merge.settings import MergeSettings
    from sim.mission.settings import MissionSettings

Maps = MapSet | Sequence[str | Path | OccupancyGrid] | str | Path
"""A map set; or map files or grids; or the folder of a run."""


def merge(
    maps: Maps,
    settings: MergeSettings | None = None,
    *,
    out: str | Path | None = None,
    workers: int = 1,
    seed: int = 0,
    **changes: Any,
) -> MergeResult:
    """Merge maps: find the transform of each pair, accept or refuse it, and fuse the maps that join.

    ``maps`` are map files (map_server YAML, PGM, PNG) or logs of robots, grids, a ``MapSet``, or the folder of a run.
    ``changes`` replace fields of the settings, as in ``merge(files, method="orb")``. With ``out``, a new folder, the
    merged map and all records are written there, as by ``mapquilt merge --out``; a run gets them in its own folder.
    ``workers`` is the number of processes.

    Raises ``ValueError`` or ``OSError`` naming the file or setting that cannot be used. Maps that do not match are no
    error: their pair is refused, with a reason.
    """
    from mapquilt.jobs.runner import Workers, remote_runner
    from mapquilt.merging.merge_folder import merge_run, refuse_merge, write_merge
    from mapquilt.merging.path_inputs import path_inputs
    from merge.merger import merge_maps
    from merge.settings import MergeSettings

    settings = dataclasses.replace(settings or MergeSettings(), **changes)
    with remote_runner(Workers(workers)) as runner:
        if isinstance(maps, str | Path):
            if out is not None:
                raise ValueError(f"out is {out}, must be None for a run, which gets the merge in its own folder")
            return merge_run(Path(maps), settings, seed, runner=runner)[0]
        if not isinstance(maps, MapSet) and any(isinstance(one, str | Path) for one in maps):
            for number, one in enumerate(maps):
                if not isinstance(one, str | Path):
                    raise ValueError(f"maps[{number}] is a {type(one).__name__}, must be a file name like the others")
            paths = [Path(one) for one in maps if isinstance(one, str | Path)]
            inputs = path_inputs(paths, None, settings=settings, seed=seed)
            for warning in inputs.warnings:
                warnings.warn(warning, stacklevel=2)
            if out is not None:
                refuse_merge(Path(out), paths)
            result = merge_maps(inputs.maps, settings, seed, runner=runner)
            if out is not None:
                write_merge(Path(out), inputs, settings, seed, result)
            return result
        if out is not None:
            raise ValueError(f"out is {out}, must be None for maps in memory; use save_map(result.merged, path)")
        return merge_maps(maps if isinstance(maps, MapSet) else _map_set(maps), settings, seed, runner=runner)


def _map_set(grids: Sequence[Any]) -> MapSet:
    for number, grid in enumerate(grids):
        if not isinstance(grid, OccupancyGrid):
            raise ValueError(f"maps[{number}] is a {type(grid).__name__}, must be a file name or an OccupancyGrid")
    return MapSet(tuple(f"map_{number}" for number in range(len(grids))), tuple(grids), tuple("m" for _ in grids))


def simulate(
    world: str,
    *,
    robots: int = 3,
    seed: int = 6,
    duration: float = 120.0,
    mission: MissionSettings | None = None,
    sampling: SampleSettings | None = None,
    out: str | Path | None = None,
) -> Sample:
    """Simulate a team of robots in a world, and return their maps with the ground truth.

    ``world`` is a family (``office``, ``cave``, ...) or a file, as for ``mapquilt simulate``; ``duration`` is in
    seconds. ``mission`` replaces ``robots`` and ``duration`` by settings for each robot; ``sampling`` holds noise,
    mapping and frame perturbation. With ``out`` the run is written to that folder.

    Raises ``ValueError`` naming the setting that is out of range, ``ImportError`` if pybullet is missing.
    """
    from mapquilt.runs.open_world import open_world
    from mapquilt.runs.sample import make_sample
    from mapquilt.runs.stages import simulate_run
    from mapquilt.settings import SampleSettings
    from sim.mission.settings import MissionSettings
    from sim.mission.simulation import simulate as simulate_mission

    place, notes = open_world(world, seed)
    for note in notes:
        warnings.warn(note, stacklevel=2)
    mission = mission or MissionSettings(robots, duration)
    sampling = sampling or SampleSettings(seed=seed)
    if out is not None:
        return simulate_run(Path(out), place, mission, sampling, seed)
    simulated, _ = simulate_mission(place, mission, seed, clear_range=sampling.mapping.clear_range)
    return make_sample(simulated, sampling)


def evaluate(result: MergeResult, maps: MapSet, truth: RunTruth) -> tuple[EvaluatedPair, ...]:
    """Evaluate every pair of a merge against the ground truth.

    ``maps`` and ``truth`` are those of the merge's own sample, as ``simulate`` or a data set gives them. Raises
    ``ValueError`` naming a map that the truth does not know.
    """
    from mapquilt.evaluation.evaluated_pair import PairInfo
    from mapquilt.scoring.run_score import evaluate_run_pair

    return tuple(
        evaluate_run_pair(maps, truth, pair, PairInfo(f"{pair.target}/{pair.source}", pair.target, pair.source))
        for pair in result.pairs
    )


def compare_methods(
    dataset: str | Path,
    methods: Sequence[str] = ("quilt", "orb"),
    *,
    split: str | None = None,
    limit: int | None = None,
    out: str | Path | None = None,
    workers: int = 1,
    seed: int = 0,
) -> BenchmarkResults:
    """Compare methods on the pairs of a data set, or an even sample of ``limit`` pairs.

    ``methods`` are names of built-in methods, or of those that ``register_method`` added. With ``out``, a new folder,
    tables, records and pictures are written there, as by ``mapquilt benchmark``.

    Raises ``ValueError`` naming an unknown method, or a folder that is no data set.
    """
    from mapping.seeds import Role, stream
    from mapquilt.benchmark.exchange.identity import data_digest
    from mapquilt.benchmark.files import SUMMARY_FILE, write_folder
    from mapquilt.benchmark.pair_sets import dataset_pairs, even_sample
    from mapquilt.benchmark.results import build_results
    from mapquilt.benchmark.trials import chosen_methods, run_benchmark
    from mapquilt.jobs.runner import Runner, Workers
    from mapquilt.runs.folder import refuse_foreign

    settings = chosen_methods(methods, None, as_published=False)
    if out is not None:
        refuse_foreign(Path(out), SUMMARY_FILE)
    pairs = dataset_pairs(Path(dataset), split)
    if limit is not None:
        pairs = even_sample(pairs, limit, stream(seed, Role.BENCHMARK_SAMPLE))
    record = {"scale": "auto", "seed": seed, "data": data_digest(pairs)}
    with Runner(Workers(workers)) as runner:
        results = build_results(run_benchmark(pairs, settings, seed, runner), seed)
    if out is not None:
        write_folder(Path(out), results, record, len(pairs))
    return results
