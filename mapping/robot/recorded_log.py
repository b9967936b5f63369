"""The log of a real robot: scans and odometry, and the reference trajectory if the file has one."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory
from mapping.wording import counted


@dataclass(frozen=True, eq=False)
class RecordedLog:
    """A log that was read from a file.

    - ``reference``: ``world_from_base`` at the stamp of each scan, corrected by another program or measured, if known;
    - ``has_odometry``: False if the file has none; the odometry of the log then stands still;
    - ``warnings``: one line each, without the name of the file.

    Raises ``ValueError`` if log and reference have different stamps.
    """

    log: RobotLog
    reference: Trajectory | None = None
    has_odometry: bool = True
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.reference is not None and not np.array_equal(self.reference.stamps, self.log.odometry.stamps):
            raise ValueError("RecordedLog: log and reference have different stamps")

    def select(self, kept: NDArray[np.int64]) -> RecordedLog:
        """Return the log with only the scans of these indices, in increasing order. Raises ``ValueError`` for none."""
        odometry = _select(self.log.odometry, kept)
        log = dataclasses.replace(self.log, scans=tuple(self.log.scans[k] for k in kept), odometry=odometry)
        reference = None if self.reference is None else _select(self.reference, kept)
        return dataclasses.replace(self, log=log, reference=reference)

    def window(self, start: float, end: float | None) -> RecordedLog:
        """Return the scans from ``start`` to ``end`` seconds after the first one; None: to the last.

        Raises ``ValueError`` if no scan lies between.
        """
        elapsed = self.log.odometry.stamps - self.log.odometry.stamps[0]
        kept = np.flatnonzero((elapsed >= start) & (elapsed <= (np.inf if end is None else end)))
        if not kept.size:
            until = "the end" if end is None else f"{end:g} s"
            raise ValueError(f"no scan from {start:g} s to {until}: the log lasts {elapsed[-1]:.1f} s")
        return self.select(kept)

    def thinned(self, max_rate: float) -> RecordedLog:
        """Return the log with at most ``max_rate`` scans a second."""
        limit = RateLimit(max_rate)
        due = [limit.is_due(stamp) for stamp in self.log.odometry.stamps.tolist()]
        return self if all(due) else self.select(np.flatnonzero(due))


class RateLimit:
    """Thin a stream to at most ``max_rate`` [Hz] on average, in one pass.

    A stream of that very rate passes whole, although its stamps jitter by up to a fifth of the period.

    Raises ``ValueError`` if the rate is not positive.
    """

    def __init__(self, max_rate: float) -> None:
        if not max_rate > 0.0:
            raise ValueError(f"max_rate is {max_rate:g}, must be positive")
        self._period = 1.0 / max_rate
        self._due: float | None = None

    def is_due(self, stamp: float) -> bool:
        """Return whether the item of this stamp [s] is kept; stamps come in increasing order."""
        due = stamp if self._due is None else self._due
        if stamp < due - 0.2 * self._period:
            return False
        self._due = max(due, stamp - self._period) + self._period
        return True


def _select(trajectory: Trajectory, kept: NDArray[np.int64]) -> Trajectory:
    return Trajectory(trajectory.stamps[kept], trajectory.poses[kept])


def usable_scans(scans: Sequence[LidarScan], places: Sequence[str]) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Find the scans that one log can hold, and say which ones it cannot.

    Dropped are scans whose stamp does not come after the one before, and those whose number of beams is not the most
    frequent one. ``places`` say where each scan stands in its file. Returns the indices of the others, (N,), and a
    warning for each kind of fault.
    """
    beams = Counter(scan.ranges.size for scan in scans).most_common(1)[0][0] if scans else 0
    kept: list[int] = []
    late: list[int] = []
    other: list[int] = []
    for index, scan in enumerate(scans):
        if scan.ranges.size != beams:
            other.append(index)
        elif kept and scan.stamp <= scans[kept[-1]].stamp:
            late.append(index)
        else:
            kept.append(index)
    warnings = []
    if late:
        warnings.append(f"{_count(late)} dropped, no later than the scan before; the first: {places[late[0]]}")
    if other:
        numbers = f"of {scans[other[0]].ranges.size} beams, not {beams}"
        warnings.append(f"{_count(other)} dropped, {numbers}; the first: {places[other[0]]}")
    return np.array(kept, np.int64), tuple(warnings)


def covered_scans(stamps: Iterable[float], trajectory: Trajectory) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Find the scans within the time of a trajectory, (N,), with a warning if there are others.

    Raises ``ValueError`` if there are none.
    """
    times = np.fromiter(stamps, np.float64)
    inside = (times >= trajectory.stamps[0]) & (times <= trajectory.stamps[-1])
    if not inside.any():
        raise ValueError(
            f"the poses from {trajectory.stamps[0]} to {trajectory.stamps[-1]} s cover no scan; "
            f"the scans run from {times[0]} to {times[-1]} s"
        )
    outside = np.flatnonzero(~inside)
    warnings = (f"{_count(outside.tolist())} dropped, outside the time of the poses",) if outside.size else ()
    return np.flatnonzero(inside), warnings


def _count(scans: Sequence[int]) -> str:
    return counted(len(scans), "scan")
