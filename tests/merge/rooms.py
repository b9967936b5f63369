"""Small worlds with maps and ground truth for the tests of the merger."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.preparation.prepared_map import PreparedMap

CELL = 0.05
RANGE = 6.0


@dataclass(frozen=True, eq=False)
class World:
    """True walls (rows, cols) at CELL metres a cell, row 0 lowest, corner at (0, 0)."""

    walls: NDArray[np.bool_]

    def wall_at(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        cells = np.floor(points / CELL).astype(int)
        rows, cols = self.walls.shape
        inside = (cells[..., 0] >= 0) & (cells[..., 0] < cols) & (cells[..., 1] >= 0) & (cells[..., 1] < rows)
        cells[~inside] = 0
        return self.walls[cells[..., 1], cells[..., 0]] | ~inside


def rooms(rng: np.random.Generator, width: float = 16.0, height: float = 11.0) -> World:
    """A rectangle split again and again by walls with doors, with boxes standing about."""
    walls = np.zeros((round(height / CELL), round(width / CELL)), dtype=bool)
    thick = 3
    _split(walls, (0, 0, *walls.shape), rng, thick)
    walls[:thick] = walls[-thick:] = True
    walls[:, :thick] = walls[:, -thick:] = True
    for _ in range(int(width * height / 8)):
        tall, wide = rng.integers(6, 24, 2)
        row, col = rng.integers(0, walls.shape[0] - tall), rng.integers(0, walls.shape[1] - wide)
        walls[row : row + tall, col : col + wide] = True
    return World(walls)


def _split(walls: NDArray[np.bool_], box: tuple[int, ...], rng: np.random.Generator, thick: int) -> None:
    row0, col0, row1, col1 = box
    across = (col1 - col0) > (row1 - row0)
    length = (col1 - col0) if across else (row1 - row0)
    if length < 110 or (length < 180 and rng.random() < 0.2):
        return
    cut = int(rng.integers(50, length - 50))
    other = (row0, row1) if across else (col0, col1)
    door = int(rng.integers(other[0] + 5, other[1] - 25))
    for low, high in ((other[0], door), (door + 20, other[1])):
        if across:
            walls[low:high, col0 + cut : col0 + cut + thick] = True
        else:
            walls[row0 + cut : row0 + cut + thick, low:high] = True
    if across:
        parts = ((row0, col0, row1, col0 + cut), (row0, col0 + cut, row1, col1))
    else:
        parts = ((row0, col0, row0 + cut, col1), (row0 + cut, col0, row1, col1))
    for part in parts:
        _split(walls, part, rng, thick)


def equal_rooms(number: int = 6) -> World:
    """A corridor along x with ``number`` equal rooms of 4 x 5 m on either side: 12 m high, 4 m a room wide."""
    room, low, high = round(4.0 / CELL), round(5.0 / CELL), round(7.0 / CELL)
    walls = np.zeros((round(12.0 / CELL), number * room + 3), dtype=bool)
    walls[:3] = walls[-3:] = walls[low : low + 3] = walls[high : high + 3] = True
    for left in range(0, walls.shape[1], room):
        walls[:low, left : left + 3] = walls[high:, left : left + 3] = True
        walls[10:30, left + 50 : left + 70] = True
        walls[low : high + 3, left + 20 : left + 38] &= False
    walls[:, :3] = walls[:, -3:] = True
    return World(walls)


def hall() -> World:
    """A hall of 14 x 9 m that looks the same when turned by half: four pillars, two benches."""
    walls = np.zeros((180, 280), dtype=bool)
    walls[:3] = walls[-3:] = True
    walls[:, :3] = walls[:, -3:] = True
    walls[40:52, 60:72] = walls[120:126, 180:230] = walls[60:68, 150:158] = True
    return World(walls | walls[::-1, ::-1])


def corridor(length: float = 40.0) -> World:
    """Two walls 2.5 m apart, and nothing else for a long way."""
    walls = np.zeros((56, round(length / CELL)), dtype=bool)
    walls[:3] = walls[-3:] = True
    return World(walls)


def cave(rng: np.random.Generator, width: float = 16.0, height: float = 11.0) -> World:
    """Winding open space without a straight wall: where smooth noise is low."""
    noise = ndimage.gaussian_filter(rng.standard_normal((round(height / CELL), round(width / CELL))), 20.0)
    walls = noise > np.quantile(noise, 0.6)
    walls[:3] = walls[-3:] = True
    walls[:, :3] = walls[:, -3:] = True
    return World(walls)


def viewpoints(
    world: World, rng: np.random.Generator, low: tuple[float, float], high: tuple[float, float], number: int = 40
) -> NDArray[np.float64]:
    """Points (number, 2) in free space within a rectangle, metres of the world."""
    found: list[NDArray[np.float64]] = []
    while len(found) < number:
        point = rng.uniform(low, high)
        around = point + 0.2 * np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)])
        if not world.wall_at(around).any():
            found.append(point)
    return np.array(found)


def observed(
    world: World,
    points: NDArray[np.float64],
    map_from_world: Similarity2,
    rng: np.random.Generator,
    resolution: float = CELL,
    noise: float = 0.0,
) -> OccupancyGrid:
    """The map of a robot that looked around from each point; cells of ``resolution`` in metres of its own map.

    ``noise`` is the standard deviation of its ranges [m of the world].
    """
    ends, frees = [], []
    for point in points:
        end, free = _look(world, point, rng, noise)
        ends.append(end)
        frees.append(free)
    hits, misses = map_from_world.apply(np.concatenate(ends)), map_from_world.apply(np.concatenate(frees))
    everything = np.concatenate((hits, misses))
    low = everything.min(axis=0) - 3.3 * resolution
    shape = np.ceil((everything.max(axis=0) - low) / resolution + 3).astype(int)[::-1]
    frame = GridFrame(resolution, SE2(*low, 0.0), (int(shape[0]), int(shape[1])))
    return OccupancyGrid(frame, _log_odds(frame, hits, misses))


def _look(
    world: World, point: NDArray[np.float64], rng: np.random.Generator, noise: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    angles = np.arange(360) * (math.tau / 360)
    along = np.arange(0.0, RANGE, CELL / 2.0)
    direction = np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    blocked = world.wall_at(point + along[None, :, None] * direction[:, None])
    first = np.where(blocked.any(axis=1), blocked.argmax(axis=1), len(along))
    reach = np.where(first < len(along), (first - 0.5) * CELL / 2.0 + noise * rng.standard_normal(len(angles)), np.inf)
    hit = np.isfinite(reach)
    ends = point + (reach[hit, None] + CELL / 4.0) * direction[hit]
    clear = along[None, :] < np.minimum(reach, RANGE)[:, None] - CELL
    beam, step = np.nonzero(clear)
    return ends, point + along[step, None] * direction[beam]


def _log_odds(frame: GridFrame, hits: NDArray[np.float64], misses: NDArray[np.float64]) -> NDArray[np.float32]:
    counts = []
    for points in (hits, misses):
        cells = frame.cells_from_metres(points)
        flat = np.bincount(cells[:, 0] * frame.shape[1] + cells[:, 1], minlength=frame.shape[0] * frame.shape[1])
        counts.append(flat.reshape(frame.shape))
    return (0.9 * counts[0] - 0.2 * np.minimum(counts[1], 40)).clip(-4, 4).astype(np.float32)


def random_similarity(rng: np.random.Generator, scale: tuple[float, float] = (1.0, 1.0)) -> Similarity2:
    size = math.exp(rng.uniform(math.log(scale[0]), math.log(scale[1])))
    return Similarity2(rng.uniform(-50, 50), rng.uniform(-50, 50), rng.uniform(-math.pi, math.pi), size)


def two_prepared_maps(build, seed, source_from_world):
    """Two maps of parts of one world, and the true transform in cells."""
    rng = np.random.default_rng(seed)
    world = build(rng)
    grids = [
        observed(world, viewpoints(world, rng, *part, number=20), frame, rng)
        for part, frame in (
            (((0.3, 0.3), (11.0, 10.7)), Similarity2()),
            (((4.5, 0.3), (15.7, 10.7)), source_from_world),
        )
    ]
    cells = [Similarity2.from_se2(grid.frame.origin, CELL) for grid in grids]
    return *(PreparedMap(grid) for grid in grids), cells[0].inverse() @ source_from_world.inverse() @ cells[1]
