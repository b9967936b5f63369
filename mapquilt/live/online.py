"""Live merging of topics of the network, in real time. Needs the extra ``[live]``."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from mapquilt.live.bag_maps import map_message, map_patch
from mapquilt.live.live_merger import LiveMerger, LiveState
from mapquilt.live.network import LATCHED, STREAM, Network, Quality, Subscription, is_kind
from mapquilt.live.published import Names, published
from mapquilt.live.received_map import MapMessage, MapPatch
from mapquilt.live.replay import Moment
from mapquilt.live.topics import MAP_TYPE, UPDATE_TYPE, UPDATES, TopicChoice, robot_names


@dataclass(frozen=True)
class OnlineSettings:
    """Times of a live merge of topics.

    - ``poll`` [s]: time between two looks at the network, which adds to the latency;
    - ``heartbeat`` [s]: tf and diagnostics are sent at least so often; tf2 extrapolates nothing.
    """

    poll: float = 0.02
    heartbeat: float = 0.5


class MapTopics:
    """The map topics that are wanted, opened as their publishers appear.

    A reader asks for no more than its publishers offer, so that best-effort and volatile ones are heard too.
    """

    def __init__(self, network: Network, choice: TopicChoice, names: Names) -> None:
        self._network, self._choice = network, choice
        self._own = {names.topic, "/mapquilt/conflicts"}
        self._open: dict[str, tuple[Quality, Subscription]] = {}
        self._names = names
        self._rivals = False

    def look(self) -> tuple[str, ...]:
        """Open what is new on the network, and tell it."""
        wanted: dict[str, tuple[str, Quality]] = {}
        rivals, events = False, []
        for each in self._network.publishers().values():
            rivals = rivals or (each.topic == self._names.topic and not each.ours)
            base = each.topic.removesuffix(UPDATES)
            for kind, topic in ((MAP_TYPE, each.topic), (UPDATE_TYPE, base)):
                if is_kind(each, kind) and topic not in self._own and self._choice.takes(topic) and not each.ours:
                    quality = each.quality.both(wanted[each.topic][1]) if each.topic in wanted else each.quality
                    wanted[each.topic] = kind, quality
        for topic, (kind, quality) in wanted.items():
            if topic not in self._open or self._open[topic][0] != quality:
                self._open[topic] = quality, self._network.subscribe(topic, kind, quality)
                events.append(f"{topic}: heard as {quality}")
        if rivals and not self._rivals:
            events.append(f"{self._names.topic}: another publisher is on the network; choose another --out-topic")
        self._rivals = rivals
        return tuple(events)

    def take(self) -> tuple[list[MapMessage | MapPatch], tuple[str, ...]]:
        """Return the maps that came since, and what could not be decoded."""
        robots = robot_names(sorted({topic.removesuffix(UPDATES) for topic in self._open}))
        messages: list[MapMessage | MapPatch] = []
        events: list[str] = []
        for topic, (_, reader) in self._open.items():
            robot = robots[topic.removesuffix(UPDATES)]
            for message in reader.take():
                if message is None:
                    events.append(f"{topic}: a message cannot be decoded; it is ignored")
                elif message.__msgtype__ == MAP_TYPE:
                    messages.append(map_message(robot, message))
                else:
                    messages.append(map_patch(robot, message))
        return messages, tuple(events)


def merge_online(
    merger: LiveMerger,
    network: Network,
    choice: TopicChoice,
    names: Names = Names(),
    *,
    until: Callable[[], bool],
    settings: OnlineSettings = OnlineSettings(),
) -> Iterator[Moment | tuple[float, str]]:
    """Merge maps as they come, and publish the result, until told to stop.

    Yields each update as a ``Moment``, and what the network tells as a time and a text. Times are those of the clock.
    """
    topics, state, last = MapTopics(network, choice, names), LiveState(), 0.0
    while not until():
        now = time.time()
        messages, told = topics.take()
        for text in (*topics.look(), *told):
            yield now, text
        if messages:
            state = merger.update(messages, now)
            yield Moment(now, state, time.time() - now)
        if messages or now - last >= settings.heartbeat:
            last = now
            for topic, message in published(state, time.time(), names, merger.settings, with_maps=bool(messages)):
                latched = topic in ("/tf_static", names.topic, "/mapquilt/conflicts")
                network.publish(topic, message, LATCHED if latched else STREAM)
        else:
            time.sleep(settings.poll)
