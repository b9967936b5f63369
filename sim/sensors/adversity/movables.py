"""Close and open doors, and let objects come and go."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.seeds import Role, stream
from sim.sensors.adversity.free_floor import FreeFloor
from sim.sensors.adversity.settings import STEP, Adversity
from worlds.polygon import edges, turned_box


@dataclass(frozen=True, eq=False)
class Movables:
    """Hold the ``segments`` (M, 2, 2) [m] of doors and objects, and the ``times`` (M, 2) [s] from when to when each
    stands."""

    segments: NDArray[np.float64]
    times: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "segments", frozen_array(self.segments, np.float64))
        object.__setattr__(self, "times", frozen_array(self.times, np.float64))

    def at(self, time: float) -> NDArray[np.float64]:
        """Return the segments that stand at a time [s]."""
        standing: NDArray[np.float64] = self.segments[(self.times[:, 0] <= time) & (time < self.times[:, 1])]
        return standing


def move_things(
    doorways: NDArray[np.float64], floor: FreeFloor, robots: NDArray[np.float64], adversity: Adversity, seed: int
) -> Movables:
    """Simulate the doors and objects of a mission.

    ``doorways`` (D, 2, 2) [m] may get doors; ``robots`` (T, R, 2) [m] are the places of the robots every ``STEP``. Each
    door and each object has a random stream of its own, so that those of lower amounts are among those of higher ones.
    An object stands at another place each time. A robot within ``opening_distance`` ends a stay, until the next one.
    """
    stays = [
        *_door_stays(doorways, robots, adversity, seed),
        *_object_stays(floor, robots, adversity, seed),
    ]
    segments = np.concatenate([np.empty((0, 2, 2)), *(each for each, _ in stays)])
    times = np.concatenate([np.empty((0, 2)), *(np.tile(time, (len(each), 1)) for each, time in stays)])
    return Movables(segments, times)


Stay = tuple[NDArray[np.float64], tuple[float, float]]
"""The segments (M, 2, 2) of a thing, and from when to when it stands."""


def _door_stays(
    doorways: NDArray[np.float64], robots: NDArray[np.float64], adversity: Adversity, seed: int
) -> Iterator[Stay]:
    for number, doorway in enumerate(doorways):
        rng = stream(seed, Role.DOORS, number)
        if rng.random() < adversity.doors:
            for time in _alternate(rng, adversity.change_time, len(robots) * STEP):
                yield from _kept(doorway[None], doorway.mean(axis=0), time, robots, adversity)


def _object_stays(floor: FreeFloor, robots: NDArray[np.float64], adversity: Adversity, seed: int) -> Iterator[Stay]:
    for number in range(floor.count(adversity.objects)):
        rng = stream(seed, Role.MOVED_OBJECTS, number)
        for time in _alternate(rng, adversity.change_time, len(robots) * STEP):
            x, y = middle = floor.random_place(rng)
            size = adversity.object_size
            box = edges(turned_box(float(x), float(y), size, size, float(rng.uniform(0.0, np.pi / 2.0))))
            yield from _kept(box, middle, time, robots, adversity)


def _alternate(rng: np.random.Generator, mean: float, end: float) -> Iterator[tuple[float, float]]:
    """Yield from when to when a two-state Markov process is on [s], up to ``end``; it starts either way."""
    time = 0.0 if rng.random() < 0.5 else mean * rng.standard_exponential()
    while time < end:
        off = time + mean * rng.standard_exponential()
        yield time, off
        time = off + mean * rng.standard_exponential()


def _kept(
    segments: NDArray[np.float64],
    middle: NDArray[np.float64],
    time: tuple[float, float],
    robots: NDArray[np.float64],
    adversity: Adversity,
) -> Iterator[Stay]:
    """Yield the stay up to the moment at which a robot comes too near, or nothing if one is there already."""
    start, stop = time
    near = (np.hypot(*np.moveaxis(robots - middle, -1, 0)) < adversity.opening_distance).any(axis=1)
    first, last = int(start / STEP), min(int(np.ceil(stop / STEP)), len(near))
    disturbed = np.flatnonzero(near[first:last])
    if disturbed.size:
        stop = min(stop, (first + int(disturbed[0])) * STEP)
    if stop > start:
        yield segments, (start, stop)
