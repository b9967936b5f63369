"""Map topics of the network, opened as their publishers appear."""

from __future__ import annotations

from collections.abc import Sequence

from mapping.io.safe_load import printable
from mapquilt.live.bag_maps import map_message, map_patch
from mapquilt.live.received_map import MapMessage, MapPatch
from mapquilt.live.ros2.dds_types import ros_name
from mapquilt.live.ros2.network import Network, Publisher, Quality, Subscription
from mapquilt.live.topics import MAP_TYPE, UPDATE_TYPE, UPDATES, Names, TopicChoice, is_ros_name, robot_names

DIAGNOSTICS = "/mapquilt/diagnostics"
"""Ending of the topic by which a live merge is known."""


class MapTopics:
    """The map topics that are wanted.

    A reader asks for no more than its publishers offer, so that best-effort and volatile ones are heard too.
    """

    def __init__(self, network: Network, choice: TopicChoice, names: Names) -> None:
        self._network, self._choice, self._names = network, choice, names
        self._own = {names.topic, names.conflicts}
        self._open: dict[str, tuple[Quality, Subscription]] = {}
        self._robots: dict[str, str] = {}
        self._remarks: dict[str, str] = {}

    def look(self) -> tuple[str, ...]:
        """Open what is new on the network, and tell it; tell what else is wrong there once, and when it has ended."""
        others = [each for each in self._network.publishers().values() if not each.ours]
        chosen = [each for each in others if self._is_chosen(each)]
        offered: dict[str, tuple[str, Quality]] = {}
        for each in chosen:
            if is_ros_name(each.topic) and _is_map(each):
                quality = each.quality.both(offered[each.topic][1]) if each.topic in offered else each.quality
                offered[each.topic] = ros_name(each.kind), quality
        events = []
        for topic, (kind, quality) in offered.items():
            if topic not in self._open or self._open[topic][0] != quality:
                depth = 1 if kind == MAP_TYPE else None
                self._open[topic] = quality, self._network.subscribe(topic, kind, quality, depth)
                events.append(f"{topic}: heard as {quality}")
        self._robots = robot_names((topic.removesuffix(UPDATES) for topic in self._open), self._robots)
        return (*events, *self._new_remarks(self._wrong(others, chosen, set(offered))))

    def missing(self) -> str | None:
        """Explain why no map is heard; None if a map topic is open."""
        if self._open:
            return None
        others = {each.topic for each in self._network.publishers().values() if _is_map(each) and not each.ours}
        maps = sorted(printable(topic) for topic in others - self._own)
        if maps:
            return f"no map on the topics that are wanted; maps are on {', '.join(maps)}"
        return "no map on the network yet; check --domain, ROS_DOMAIN_ID and CYCLONEDDS_URI"

    def take(self) -> tuple[list[MapMessage | MapPatch], tuple[str, ...]]:
        """Return the maps that came since, in the order of their stamps, and what could not be decoded."""
        messages: list[MapMessage | MapPatch] = []
        events: list[str] = []
        for topic, (_, reader) in self._open.items():
            robot = self._robots[topic.removesuffix(UPDATES)]
            for message in reader.take():
                if message is None:
                    events.append(f"{topic}: a message cannot be decoded; it is ignored")
                elif message.__msgtype__ == MAP_TYPE:
                    messages.append(map_message(robot, message))
                else:
                    messages.append(map_patch(robot, message))
        return sorted(messages, key=lambda message: message.stamp), tuple(events)

    def _is_chosen(self, publisher: Publisher) -> bool:
        base = publisher.topic.removesuffix(UPDATES) if ros_name(publisher.kind) == UPDATE_TYPE else publisher.topic
        return base not in self._own and self._choice.takes(base)

    def _wrong(self, others: Sequence[Publisher], chosen: Sequence[Publisher], offered: set[str]) -> dict[str, str]:
        """Return what is wrong on the network now, and for each what to say once it has ended, if anything."""
        found = {}
        for each in others:
            if each.topic == self._names.topic:
                found[f"{each.topic}: another process sends it too; choose another --out-topic or --namespace"] = ""
            if each.topic.endswith(DIAGNOSTICS):
                found[f"{each.topic}: another live merge is on the network, and both send tf; stop one of them"] = (
                    f"{each.topic}: the other live merge has gone"
                )
        for each in chosen:
            name = printable(each.topic)
            if not is_ros_name(each.topic):
                found[f"{name}: is no name of a ROS topic; it is ignored"] = ""
            elif not _is_map(each):
                found[f"{name}: sends {printable(ros_name(each.kind))}, must be {MAP_TYPE}; it is ignored"] = ""
        for topic in self._open.keys() - offered:
            found[f"{topic}: its publisher has gone; the last map stays"] = f"{topic}: a publisher is back"
        return found

    def _new_remarks(self, found: dict[str, str]) -> tuple[str, ...]:
        """Remember what is wrong now; return what has begun and what has ended."""
        begun = [text for text in found if text not in self._remarks]
        ended = [last for text, last in self._remarks.items() if last and text not in found]
        self._remarks = found
        return (*begun, *ended)


def _is_map(publisher: Publisher) -> bool:
    kind = ros_name(publisher.kind)
    return kind == MAP_TYPE or (kind == UPDATE_TYPE and publisher.topic.endswith(UPDATES))
