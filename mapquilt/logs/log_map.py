"""Mapping a log: from its scans and odometry to poses and a grid."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from mapping.grid.log_odds import map_log
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.sensor_model import sensor_model
from mapping.particle.filter import particle_filter
from mapping.robot.recorded_log import RecordedLog
from mapping.seeds import Role, derived_seed
from mapping.settings import PARTICLE, MappingSettings
from mapping.slam.front_end import FRONT_ENDS, without_graph
from mapping.slam.result import SlamResult
from mapping.slam.settings import TRUE_POSES
from mapquilt.evaluation.trajectory_error import AbsoluteError, absolute_error
from mapquilt.logs.load_log import NamedLog
from mapquilt.logs.log_files import unique_names
from mapquilt.runs.true_footprints import part_bounds
from mapquilt.settings import check_parts

REFERENCE = "reference"
"""The name of a log's reference poses on the command line; ``TRUE_POSES`` in the settings of mapping."""

LOG_SEED = 0
"""Seed of the maps of logs; their records state it as ``sample_seed``."""

LOG_POSES = (*FRONT_ENDS, REFERENCE)
"""Values of ``--poses`` for a log."""


@dataclass(frozen=True, eq=False)
class LogMap:
    """The map of one log: ``result`` are the poses that its ``grid`` was drawn at, both in the frame of the start."""

    name: str
    path: Path
    recorded: RecordedLog
    settings: MappingSettings
    result: SlamResult
    grid: OccupancyGrid

    @property
    def poses(self) -> str:
        """The name of the poses, as ``--poses`` gives it, or the mapper that estimated them."""
        return REFERENCE if self.settings.poses == TRUE_POSES else self.settings.pose_source

    @property
    def error(self) -> AbsoluteError | None:
        """The error against the reference; None without one, or if the map was drawn at it."""
        reference = self.recorded.reference
        if reference is None or len(reference) < 2 or self.settings.poses == TRUE_POSES:
            return None
        return absolute_error(self.result.trajectory, reference)


def cut_logs(logs: tuple[NamedLog, ...], parts: int) -> tuple[NamedLog, ...]:
    """Cut each log into parts of as many scans, called ``part_0`` and so on, after the log if there are several.

    Raises ``ValueError`` naming the log that has fewer scans than parts.
    """
    check_parts(parts)
    names = unique_names([log.name for log in logs])
    cut = []
    for name, log in zip(names, logs, strict=True):
        scans = len(log.recorded.log.scans)
        if scans < parts:
            raise ValueError(f"{log.path}: has {scans} scans, fewer than {parts} parts")
        for part in range(parts):
            start, stop = part_bounds(scans, part, parts)
            called = [*([name] if len(logs) > 1 or parts == 1 else []), *([f"part_{part}"] if parts > 1 else [])]
            cut.append(NamedLog("_".join(called), log.recorded.select(np.arange(start, stop)), log.path))
    return tuple(cut)


def draw_log(
    log: NamedLog, settings: MappingSettings, on_scan: Callable[[int], None] = lambda _: None, index: int = 0
) -> LogMap:
    """Estimate the poses of a log and draw its map.

    ``on_scan`` gets the number of scans done; ``index`` counts the maps of a run, for their random numbers. Raises
    ``ValueError`` naming the log if it lacks the poses that the settings ask for, or no beam measured anything.
    """
    recorded = replace(log.recorded, log=replace(log.recorded.log, robot=log.name))
    try:
        if settings.mapper == PARTICLE:
            result, grid = _filter(recorded, settings, on_scan, index)
        else:
            result = _estimate(recorded, settings, on_scan)
            model = sensor_model(settings.sensor_model)
            grid = map_log(recorded.log, result.trajectory, settings.resolution, model, settings.clear_range)
    except ValueError as error:
        raise ValueError(f"{log.path}: {error}") from None
    on_scan(len(recorded.log.scans))
    return LogMap(log.name, log.path, recorded, settings, result, grid)


def draw_logs(
    logs: Sequence[NamedLog], settings: MappingSettings, on_progress: Callable[[int, int], None]
) -> list[LogMap]:
    """Draw the map of each log of a run; ``on_progress`` gets the scans done and all. Raises as ``draw_log``."""
    total = sum(len(log.recorded.log.scans) for log in logs)
    done, drawn = 0, []
    for index, log in enumerate(logs):
        drawn.append(draw_log(log, settings, partial(_on_scan, on_progress, done, total), index))
        done += len(log.recorded.log.scans)
    return drawn


def _on_scan(on_progress: Callable[[int, int], None], before: int, total: int, done: int) -> None:
    on_progress(before + done, total)


def _filter(
    recorded: RecordedLog, settings: MappingSettings, on_scan: Callable[[int], None], index: int
) -> tuple[SlamResult, OccupancyGrid]:
    if not recorded.has_odometry:
        raise ValueError(
            f"has no odometry, which --mapper {PARTICLE} needs; `mapquilt map --odometry` takes a file of it"
        )
    filtered = particle_filter(
        recorded.log,
        settings.particle,
        derived_seed(LOG_SEED, Role.PARTICLE_FILTER, index),
        on_scan,
        resolution=settings.resolution,
        clear_range=settings.clear_range,
    )
    return SlamResult(filtered.trajectory, np.empty(0, np.int64), (), filtered.timings), filtered.grid


def _estimate(recorded: RecordedLog, settings: MappingSettings, on_scan: Callable[[int], None]) -> SlamResult:
    if settings.poses == TRUE_POSES:
        if recorded.reference is None:
            raise ValueError(f"has no reference poses; choose other --poses: {', '.join(FRONT_ENDS)}")
        return without_graph(recorded.reference.from_start())
    if settings.poses == "odometry" and not recorded.has_odometry:
        raise ValueError(
            "has no odometry; `mapquilt map` takes a file of it by --odometry, and maps without it by other --poses"
        )
    motion = replace(settings.slam.motion, odometry=settings.slam.motion.odometry and recorded.has_odometry)
    return FRONT_ENDS[settings.poses](recorded.log, replace(settings.slam, motion=motion), on_scan)
