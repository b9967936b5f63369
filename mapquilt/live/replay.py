"""Live merging of a bag in bag time, as fast as it can: the offline twin of a live merge."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from mapquilt.convert.ros_bag import BagWriter
from mapquilt.live.live_merger import LiveMerger, LiveState
from mapquilt.live.published import published
from mapquilt.live.received_map import MapMessage, MapPatch
from mapquilt.live.topics import Names


@dataclass(frozen=True, eq=False)
class Moment:
    """One update of a replay: bag time ``now`` [s], the state after it, and the ``seconds`` that it took."""

    now: float
    state: LiveState
    seconds: float


def replay(
    merger: LiveMerger, messages: Iterable[tuple[float, MapMessage | MapPatch]], freeze_after: float | None = None
) -> Iterator[Moment]:
    """Give each message to the merger at its time; freeze it ``freeze_after`` seconds after the first."""
    start: float | None = None
    for now, message in messages:
        start = now if start is None else start
        merger.frozen = merger.frozen or (freeze_after is not None and now - start >= freeze_after)
        before = time.perf_counter()
        state = merger.update([message], now)
        yield Moment(now, state, time.perf_counter() - before)


class PublishedBag:
    """Write what a live merge publishes to a bag, in bag time; merged maps at most every ``map_period`` [s].

    ``close`` writes the last state, whose merged map may have been left out.
    """

    def __init__(self, bag: BagWriter, merger: LiveMerger, names: Names = Names(), map_period: float = 1.0) -> None:
        self._bag, self._merger, self._names, self._period = bag, merger, names, map_period
        self._next_map, self._last = 0.0, Moment(0.0, merger.state, 0.0)
        self._held: tuple[str, ...] = ()

    def write(self, moment: Moment, *, last: bool = False) -> None:
        """Write one moment."""
        with_maps = last or moment.now >= self._next_map
        self._next_map = moment.now + self._period if with_maps else self._next_map
        held = tuple(name for name, each in moment.state.placements.items() if each.holds_frame)
        settings, frozen = self._merger.settings, self._merger.frozen
        for topic, message in published(
            moment.state, moment.now, self._names, settings, with_maps=with_maps, frozen=frozen
        ):
            if topic != "/tf_static" or held != self._held:
                self._bag.write(topic, message, round(1e9 * moment.now))
        self._held, self._last = held, moment

    def close(self) -> None:
        """Write the last moment with its maps."""
        if self._last.now > 0.0:
            self.write(self._last, last=True)
