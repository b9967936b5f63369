"""Particle filter: from a log to the path and the map of its best particle.

Source: Grisetti, Stachniss and Burgard, "Improved techniques for grid mapping with Rao-Blackwellized particle filters",
T-RO 23 (2007), algorithm 1; updates and weights are those of gmapping's ``GridSlamProcessor::processScan``.
"""

from __future__ import annotations

import math
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.log_odds import counting_log_odds
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.sensor_model import COUNTING
from mapping.particle.matching import endpoints
from mapping.particle.proposal import propose
from mapping.particle.resampling import effective_sample_size, low_variance_sample, normalised_weights
from mapping.particle.settings import ParticleSettings
from mapping.particle.tiles import TiledMaps
from mapping.robot.robot_log import RobotLog
from mapping.robot.trajectory import Trajectory
from mapping.seeds import Role, stream


@dataclass(frozen=True, eq=False)
class ParticleResult:
    """Path and map of the best particle, and the course of the filter.

    - ``trajectory``: ``start_from_base`` at the stamp of each scan, the first at the identity; between updates it
      follows the odometry;
    - ``grid``: the best particle's map, occupied where more than a quarter of the visits were hits;
    - ``updates`` (U,): indices of the scans that the filter processed;
    - ``paths`` (N, U, 3): poses of each particle and its ancestors at the updates; ``best`` is the best one's index;
    - ``effective_sizes`` (U,): effective sample size at each update, 1 to N;
    - ``resampled``: indices of the updates after which the particles were resampled;
    - ``map_bytes``: greatest memory of the maps of all particles;
    - ``timings``: time of each step [s].
    """

    trajectory: Trajectory
    grid: OccupancyGrid
    updates: NDArray[np.int64]
    paths: NDArray[np.float64]
    best: int
    effective_sizes: NDArray[np.float64]
    resampled: tuple[int, ...]
    map_bytes: int
    timings: Mapping[str, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "updates", frozen_array(self.updates, np.int64))
        object.__setattr__(self, "paths", frozen_array(self.paths, np.float64))
        object.__setattr__(self, "effective_sizes", frozen_array(self.effective_sizes, np.float64))


def particle_filter(
    log: RobotLog,
    settings: ParticleSettings = ParticleSettings(),
    seed: int = 0,
    on_scan: Callable[[int], None] = lambda _: None,
    *,
    resolution: float = 0.05,
    clear_range: float = 0.0,
) -> ParticleResult:
    """Map a log; the same seed gives the same result, bit for bit.

    ``on_scan`` gets the number of scans done. ``resolution`` [m] is the cell size of the maps; beams without a return
    clear their cells up to ``clear_range`` [m]. Raises ``ValueError`` if no beam of a processed scan measured anything,
    a map would get more than 400 million cells, or the seed is not valid.
    """
    run = _Filter(log, settings, stream(seed, Role.PARTICLE_FILTER), resolution, clear_range)
    for index in range(len(log.scans)):
        run.process(index)
        on_scan(index + 1)
    return run.result()


class _Filter:
    """Particles after the scans so far: the poses (N, 3), maps and weights, and the updates that led to them."""

    def __init__(
        self, log: RobotLog, settings: ParticleSettings, rng: np.random.Generator, resolution: float, clear_range: float
    ) -> None:
        self.log = log
        self.settings = settings
        self.rng = rng
        self.clear_range = clear_range
        count = settings.particles
        self.maps = TiledMaps(count, resolution)
        self.poses = np.zeros((count, 3))
        self.log_weights = np.zeros(count)  # since the last resampling
        self.evidence = np.zeros(count)  # log-likelihood of the whole path
        self.driven = self.turned = 0.0
        self.updates: list[int] = []
        self.history: list[NDArray[np.float64]] = []
        self.ancestors: list[NDArray[np.int64]] = []
        self.sizes: list[float] = []
        self.resampled: list[int] = []
        self.map_bytes = 0
        self.timings: dict[str, float] = defaultdict(float)

    def process(self, index: int) -> None:
        """Update the particles by a scan if the robot has moved enough since the last update."""
        if self.updates:
            odometry = self.log.odometry
            step = odometry.pose(index - 1).inverse() @ odometry.pose(index)
            self.driven += math.hypot(step.x, step.y)
            self.turned += abs(step.yaw)
            if self.driven < self.settings.update_distance and self.turned < self.settings.update_angle:
                return
            self._move(odometry.pose(self.updates[-1]).inverse() @ odometry.pose(index), index)
        self.driven = self.turned = 0.0
        self.updates.append(index)
        self._draw(index)
        self._resample()
        self.history.append(self.poses)
        self.map_bytes = max(self.map_bytes, self.maps.nbytes())

    def _move(self, motion: SE2, index: int) -> None:
        """Draw the next pose of each particle, and weigh it."""
        with self._timed("match"):
            scan = endpoints(self.log.scans[index], self.log.base_from_lidar, self.settings.matching)
            self.poses, log_weights = propose(self.poses, motion, scan, self.maps, self.settings, self.rng)
        self.log_weights = self.log_weights + log_weights / self.settings.weight_smoothing
        self.evidence = self.evidence + log_weights

    def _draw(self, index: int) -> None:
        """Add a scan to the map of each particle."""
        with self._timed("draw"):
            for particle, pose in enumerate(self.poses):
                map_from_lidar = SE2(*pose) @ self.log.base_from_lidar
                self.maps.integrate(particle, self.log.scans[index], map_from_lidar, self.clear_range)

    def _resample(self) -> None:
        """Replace the particles by draws from their weights, if few of them carry most of the weight."""
        weights = normalised_weights(self.log_weights)
        count = len(weights)
        self.sizes.append(effective_sample_size(weights))
        drawn = np.arange(count)
        if self.sizes[-1] < self.settings.resample_below * count:
            drawn = low_variance_sample(weights, self.rng)
            self.maps.resample(drawn)
            self.poses, self.evidence, self.log_weights = self.poses[drawn], self.evidence[drawn], np.zeros(count)
            self.resampled.append(len(self.updates) - 1)
        self.ancestors.append(drawn)

    def result(self) -> ParticleResult:
        best = int(self.evidence.argmax())
        paths = self._paths()
        return ParticleResult(
            trajectory=self._trajectory(paths[best]),
            grid=particle_grid(self.maps, best),
            updates=np.array(self.updates),
            paths=paths,
            best=best,
            effective_sizes=np.array(self.sizes),
            resampled=tuple(self.resampled),
            map_bytes=self.map_bytes,
            timings=dict(self.timings),
        )

    def _paths(self) -> NDArray[np.float64]:
        """Trace each particle back through its ancestors: poses (N, U, 3)."""
        particles = np.arange(self.settings.particles)
        backwards = []
        for poses, ancestors in zip(reversed(self.history), reversed(self.ancestors), strict=True):
            backwards.append(poses[particles])
            particles = ancestors[particles]
        return np.stack(backwards[::-1], axis=1)

    def _trajectory(self, path: NDArray[np.float64]) -> Trajectory:
        """Join the poses (U, 3) at the updates by the odometry after each of them."""
        odometry = self.log.odometry
        poses = []
        ends = [*self.updates[1:], len(odometry)]
        for pose, start, end in zip(path, self.updates, ends, strict=True):
            start_from_odom = SE2(*pose) @ odometry.pose(start).inverse()
            poses.append(odometry.part(start, end).moved(start_from_odom).poses)
        return Trajectory(odometry.stamps, np.concatenate(poses))

    @contextmanager
    def _timed(self, step: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.timings[step] += time.perf_counter() - start


def particle_grid(maps: TiledMaps, particle: int) -> OccupancyGrid:
    """Return the map of a particle, cropped to the observed cells. Raises ``ValueError`` if there are none."""
    hits, visits = maps.counts(particle)
    if not visits.any():
        raise ValueError("particle_filter: no beam of any scan measured anything, so there is no map")
    resolution = maps.resolution
    origin = SE2(float(maps.first[1]) * resolution, float(maps.first[0]) * resolution)
    frame = GridFrame(resolution, origin, (visits.shape[0], visits.shape[1]))
    return OccupancyGrid(frame, counting_log_odds(hits, visits, COUNTING)).cropped()
