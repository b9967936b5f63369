"""Live merging of topics of the network, in real time. Needs the extra ``[live]``."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Event, Lock

from mapquilt.live.live_merger import LiveMerger, LiveState
from mapquilt.live.published import published
from mapquilt.live.replay import Moment
from mapquilt.live.robots import told_silence
from mapquilt.live.ros2.clock import Clock
from mapquilt.live.ros2.controls import Controls
from mapquilt.live.ros2.map_topics import MapTopics
from mapquilt.live.ros2.network import LATCHED, STREAM, Network
from mapquilt.live.topics import Names, TopicChoice


@dataclass(frozen=True)
class OnlineSettings:
    """Times of a live merge of topics.

    - ``poll`` [s]: time between two looks at the network, which adds to the latency;
    - ``heartbeat`` [s]: tf and diagnostics are sent at least so often, also while an update takes longer; tf2
      extrapolates nothing;
    - ``hint_after`` [s]: if no map topic was found by then, it is told what there is.
    """

    poll: float = 0.02
    heartbeat: float = 0.5
    hint_after: float = 5.0


@dataclass(frozen=True, eq=False)
class Cycle:
    """One look at the network.

    ``now`` [s] of the clock, None as long as it is unknown; the ``state``; the ``moment`` of the update, None if no map
    came; ``events`` tell what the network does; ``record`` says that someone asks for a record of the merge.
    """

    now: float | None
    state: LiveState
    moment: Moment | None = None
    events: tuple[str, ...] = ()
    record: bool = False


def merge_online(
    merger: LiveMerger,
    network: Network,
    choice: TopicChoice,
    names: Names = Names(),
    *,
    clock: Clock = time.time,
    settings: OnlineSettings = OnlineSettings(),
) -> Generator[Cycle]:
    """Merge maps as they come, and publish the result, for as long as the caller asks for cycles.

    The caller may freeze the merger between two cycles; so may others, by a topic.
    """
    topics, controls = MapTopics(network, choice, names), Controls(network, names)
    publication = _Publication(merger, network, names, clock)
    silent: frozenset[str] = frozenset()
    last, frozen, waiting = clock(), False, False
    hint_at = time.monotonic() + settings.hint_after
    if last is None:
        yield Cycle(None, merger.state, events=("/clock: nothing heard yet; waits for the simulated time",))
    with _repeated(publication.send, settings.heartbeat) as check:
        while True:
            check()
            now = clock()
            if now is None:
                time.sleep(settings.poll)
                yield Cycle(None, merger.state)
                continue
            events = list(topics.look())
            if time.monotonic() >= hint_at:
                hint_at = math.inf
                events += filter(None, [topics.missing()])
            if last is not None and now < last:
                events.append(f"time went back by {last - now:.1f} s")
            last = now
            wish = controls.freeze()
            merger.frozen = merger.frozen if wish is None else wish
            if merger.frozen is not frozen:
                frozen = merger.frozen
                events.append("frozen: all poses are held" if frozen else "not frozen: poses follow the maps")
            messages, unreadable = topics.take()
            moment = None
            if messages or merger.is_still(now):
                start = time.perf_counter()
                state = merger.update(messages, now)
                moment = Moment(now, state, time.perf_counter() - start)
                publication.send(with_maps=True)
            silent, told = told_silence(merger.state.robots, silent, now, merger.settings)
            yield Cycle(now, merger.state, moment, (*events, *unreadable, *told), controls.record())
            waiting = bool(messages) or (waiting and merger.catch_up())
            if not waiting:
                time.sleep(settings.poll)


class _Publication:
    """Send the state of a merger, by one thread at a time, so that no older state follows a newer one."""

    def __init__(self, merger: LiveMerger, network: Network, names: Names, clock: Clock) -> None:
        self._merger, self._network, self._names, self._clock = merger, network, names, clock
        self._lock = Lock()

    def send(self, with_maps: bool = False) -> None:
        """Send what is published at this time, if that is known."""
        with self._lock:
            now, merger, names = self._clock(), self._merger, self._names
            if now is None:
                return
            messages = published(merger.state, now, names, merger.settings, with_maps=with_maps, frozen=merger.frozen)
            for topic, message in messages:
                latched = topic in ("/tf_static", names.topic, names.conflicts)
                self._network.publish(topic, message, LATCHED if latched else STREAM)


@contextmanager
def _repeated(action: Callable[[], None], period: float) -> Iterator[Callable[[], None]]:
    """Call a function every ``period`` [s] in a thread of its own, at once first. Yields a function that raises the
    error by which the thread has ended, if it has."""
    over = Event()

    def repeat() -> None:
        action()
        while not over.wait(period):
            action()

    with ThreadPoolExecutor(1) as executor:
        running = executor.submit(repeat)
        try:
            yield lambda: running.result() if running.done() else None
        finally:
            over.set()
