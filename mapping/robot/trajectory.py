"""Poses of a robot over time, true or estimated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapping.arrays import frozen_array
from mapping.geometry.se2 import SE2

FARTHEST = 1e9
"""The largest coordinate of a pose [m]: nothing on Earth is farther away."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Poses over time: ``stamps`` (N,) in seconds, strictly increasing; ``poses`` (N, 3) rows of x, y [m], yaw [rad].

    Raises ``ValueError`` if the shapes differ, a number is not finite, a pose is too far away, or stamps do not
    increase.
    """

    stamps: NDArray[np.float64]
    poses: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "stamps", frozen_array(self.stamps, np.float64))
        object.__setattr__(self, "poses", frozen_array(self.poses, np.float64))
        if self.stamps.ndim != 1 or self.poses.shape != (self.stamps.size, 3):
            raise ValueError(
                f"Trajectory: stamps {self.stamps.shape} and poses {self.poses.shape} need (N,) and (N, 3)"
            )
        for name in ("stamps", "poses"):
            if not np.isfinite(getattr(self, name)).all():
                raise ValueError(f"Trajectory: {name} holds a number that is not finite")
        if self.poses.size and np.abs(self.poses[:, :2]).max() > FARTHEST:
            raise ValueError(f"Trajectory: a pose lies more than {FARTHEST:g} m away")
        backwards = np.flatnonzero(np.diff(self.stamps) <= 0.0)
        if backwards.size:
            k = int(backwards[0])
            raise ValueError(f"Trajectory: stamp {self.stamps[k + 1]} s does not come after {self.stamps[k]} s")

    def __len__(self) -> int:
        return int(self.stamps.size)

    def pose(self, index: int) -> SE2:
        return SE2(*self.poses[index])

    def moved(self, new_from_old: SE2) -> Trajectory:
        """Express the trajectory in another frame."""
        poses = np.empty_like(self.poses)
        poses[:, :2] = new_from_old.apply(self.poses[:, :2])
        poses[:, 2] = self.poses[:, 2] + new_from_old.yaw
        return Trajectory(self.stamps, poses)

    def part(self, start: int, stop: int) -> Trajectory:
        """Return poses ``start`` to ``stop - 1``, in the same frame."""
        return Trajectory(self.stamps[start:stop], self.poses[start:stop])

    def interpolated(self, stamps: ArrayLike) -> Trajectory:
        """Return the poses at other stamps (M,) [s]: linear in x and y, in yaw the shorter way round.

        Raises ``ValueError`` if a stamp lies outside the trajectory, or the stamps do not increase.
        """
        stamps = np.asarray(stamps, dtype=np.float64)
        outside = (stamps < self.stamps[0]) | (stamps > self.stamps[-1])
        if outside.any():
            raise ValueError(
                f"Trajectory: stamp {stamps[outside][0]} s lies outside {self.stamps[0]} to {self.stamps[-1]} s"
            )
        x, y, yaw = self.poses.T
        columns = [np.interp(stamps, self.stamps, column) for column in (x, y, np.unwrap(yaw))]
        return Trajectory(stamps, np.stack(columns, axis=-1))

    def from_start(self) -> Trajectory:
        """Express the trajectory in the frame of its first pose."""
        return self.moved(self.pose(0).inverse())

    def distance(self) -> float:
        """Return the length of the path [m]."""
        return float(np.hypot(*np.diff(self.poses[:, :2], axis=0).T).sum())
