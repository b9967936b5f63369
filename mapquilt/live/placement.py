"""State machine of one map's pose in the merged frame, which never jumps.

``advance`` is the whole machine: the table in docs/live.md lists its transitions. A pose that is published moves by at
most a step per update; a pose that is wrong is not moved but taken back, and the map joins anew.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import wrap_angle
from mapping.geometry.similarity2 import Similarity2
from mapquilt.live.settings import PlacementSettings


class State(Enum):
    """State of a map: only ``JOINED`` and ``SUSPECT`` have a pose on tf and a place in the merged map."""

    ALONE = "alone"
    CANDIDATE = "candidate"
    JOINED = "joined"
    SUSPECT = "suspect"


@dataclass(frozen=True)
class Sighting:
    """A pose ``merged_from_map`` that the current maps give.

    ``sigma`` [m] and ``yaw_sigma`` [rad] are its standard deviations at the middle of the map, ``confidence`` that of
    the surest chain of accepted pairs to the merged frame.
    """

    merged_from_map: Similarity2
    sigma: float
    yaw_sigma: float
    confidence: float


@dataclass(frozen=True)
class Missing:
    """No pose: no accepted pair leads to the merged frame. ``contradicted`` if cells speak against the pose held."""

    reason: str
    contradicted: bool = False


@dataclass(frozen=True)
class Placement:
    """State of a map in the merged frame.

    ``held`` is the pose that is published, or the one that waits for confirmation; ``count`` the updates that confirmed
    or contradicted it in a row; ``reason`` explains the last change for people.
    """

    state: State = State.ALONE
    held: Sighting | None = None
    count: int = 0
    reason: str = "no pair with another map is accepted yet"

    @property
    def published(self) -> Similarity2 | None:
        """Pose on tf: None unless the map is joined."""
        return self.held.merged_from_map if self.held is not None and self.is_joined else None

    @property
    def holds_frame(self) -> bool:
        """Check if the merged frame is fixed to this map, whose pose is then exact and never changes."""
        return self.is_joined and self.held is not None and self.held.sigma == 0.0

    @property
    def is_joined(self) -> bool:
        return self.state in (State.JOINED, State.SUSPECT)


def anchor(pose: Similarity2) -> Placement:
    """Return the placement of a map that fixes the merged frame."""
    return Placement(State.JOINED, Sighting(pose, 0.0, 0.0, 1.0), 0, "fixes the merged frame")


def advance(
    placement: Placement,
    seen: Sighting | Missing,
    middle: NDArray[np.float64],
    settings: PlacementSettings = PlacementSettings(),
) -> Placement:
    """Return the next placement of a map after an update that changed its maps.

    ``middle`` (2,) is the middle of the map [m, in its frame], where displacements are measured.
    """
    if placement.held is None or not placement.is_joined:
        return _towards_a_join(placement, seen, middle, settings)
    if isinstance(seen, Sighting) and agree(placement.held, seen, middle, settings):
        moved = blended(placement.held.merged_from_map, seen.merged_from_map, middle, settings)
        return Placement(State.JOINED, replace(seen, merged_from_map=moved), 0, "")
    if isinstance(seen, Sighting) and seen.confidence < placement.held.confidence:
        return placement  # another place, but not better than the one held
    if isinstance(seen, Sighting):
        shift, turn = displacement(placement.held.merged_from_map, seen.merged_from_map, middle)
        reason, limit = f"fits better {shift:.1f} m and {math.degrees(turn):.0f} degrees away", settings.patience
    else:
        reason = f"no pair supports it any more: {seen.reason}"
        limit = settings.patience if seen.contradicted else settings.long_patience
    count = placement.count + 1
    if count >= limit:
        return Placement(State.ALONE, None, 0, f"taken back: {reason}")
    return Placement(State.SUSPECT, placement.held, count, reason)


def _towards_a_join(
    placement: Placement, seen: Sighting | Missing, middle: NDArray[np.float64], settings: PlacementSettings
) -> Placement:
    """Return the next placement of a map that is not joined."""
    if isinstance(seen, Missing):
        reason = placement.reason if placement.reason.startswith("taken back") else seen.reason
        return Placement(State.ALONE, None, 0, reason)
    if seen.confidence < settings.join_confidence:
        reason = f"confidence is {seen.confidence:.2f}, joins from {settings.join_confidence:g} on"
        return Placement(State.ALONE, None, 0, reason)
    again = placement.held is not None and agree(placement.held, seen, middle, settings)
    count = placement.count + 1 if again else 1
    if count >= settings.confirmations:
        return Placement(State.JOINED, seen, 0, "")
    return Placement(State.CANDIDATE, seen, count, f"waits for {settings.confirmations - count} more updates to agree")


def restarted(reason: str) -> Placement:
    """Return the placement of a map whose frame is new: all that was known of the old one is void."""
    return Placement(State.ALONE, None, 0, reason)


def agree(
    first: Sighting, second: Sighting, middle: NDArray[np.float64], settings: PlacementSettings = PlacementSettings()
) -> bool:
    """Test if two poses are one answer, by the uncertainties of both."""
    shift, turn = displacement(first.merged_from_map, second.merged_from_map, middle)
    return shift <= settings.gate * math.hypot(first.sigma, second.sigma) and turn <= settings.gate * math.hypot(
        first.yaw_sigma, second.yaw_sigma
    )


def displacement(first: Similarity2, second: Similarity2, middle: NDArray[np.float64]) -> tuple[float, float]:
    """Return the distance [m] of the images of the middle under two poses, and the angle [rad] between these."""
    moved = second.apply(middle) - first.apply(middle)
    return math.hypot(*moved.tolist()), abs(wrap_angle(second.yaw - first.yaw))


def blended(
    held: Similarity2, seen: Similarity2, middle: NDArray[np.float64], settings: PlacementSettings = PlacementSettings()
) -> Similarity2:
    """Move a pose towards another by the share ``blend`` of the way, and by at most a step, about the map's middle."""
    shift, turn = displacement(held, seen, middle)
    most = min(settings.max_step / shift if shift > 0.0 else 1.0, settings.max_turn / turn if turn > 0.0 else 1.0)
    share = min(settings.blend, most)
    yaw = held.yaw + share * wrap_angle(seen.yaw - held.yaw)
    x, y = (held.apply(middle) + share * (seen.apply(middle) - held.apply(middle))).tolist()
    offset = Similarity2(yaw=yaw, scale=held.scale).apply(middle)
    return Similarity2(x - float(offset[0]), y - float(offset[1]), yaw, held.scale)
