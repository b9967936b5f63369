"""Topics of maps, the robots that they are of, and the names of what is published."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

MAP_TYPE = "nav_msgs/msg/OccupancyGrid"
UPDATE_TYPE = "map_msgs/msg/OccupancyGridUpdate"
UPDATES = "_updates"
"""Ending of the topic on which a map's updates come."""

_ROS_NAME = re.compile(r"(?:/[A-Za-z_][A-Za-z0-9_]*)+")


@dataclass(frozen=True)
class TopicChoice:
    """The topics to take: those named, and those that match the pattern ``discover``; without either, all maps."""

    topics: Sequence[str] = ()
    discover: str | None = None

    def takes(self, topic: str) -> bool:
        """Check if the maps of a topic are wanted."""
        if topic in self.topics:
            return True
        if self.discover is not None:
            return fnmatch.fnmatchcase(topic, self.discover)
        return not self.topics


@dataclass(frozen=True)
class Names:
    """Names of what is published: the ``frame`` and the ``topic`` of the merged map, and the ``prefix`` of the other
    topics."""

    frame: str = "map_merged"
    topic: str = "/map_merged"
    prefix: str = "/mapquilt"

    @classmethod
    def of(cls, frame: str, topic: str, namespace: str = "") -> Names:
        """Name topics in a namespace, as ROS does: a topic that starts with / stays where it is.

        Raises ``ValueError`` naming the option that is no name.
        """
        space = namespace.strip("/") and f"/{namespace.strip('/')}"
        if space and not is_ros_name(space):
            raise ValueError(f"--namespace {namespace}: must be a name of ROS, such as fleet or /site/fleet")
        full = topic if topic.startswith("/") else f"{space}/{topic}"
        if not is_ros_name(full):
            raise ValueError(f"--out-topic {topic}: must be a name of a ROS topic, such as map_merged or /map")
        if not frame or frame.startswith("/"):
            raise ValueError(f"--frame {frame!r}: must be the name of a frame, such as map_merged, with no / before it")
        return cls(frame, full, f"{space}/mapquilt")

    @property
    def conflicts(self) -> str:
        """Topic of the conflicts."""
        return f"{self.prefix}/conflicts"

    @property
    def diagnostics(self) -> str:
        """Topic of the diagnostics."""
        return f"{self.prefix}/diagnostics"


def is_ros_name(topic: str) -> bool:
    """Check if this is the full name of a topic as ROS 2 allows it."""
    return _ROS_NAME.fullmatch(topic) is not None


def robot_names(topics: Iterable[str], known: Mapping[str, str] = MappingProxyType({})) -> dict[str, str]:
    """Name the robot of each topic by its namespace: ``/robot_0/map`` is of ``robot_0``.

    Topics whose namespaces are the same, such as ``/a/map`` and ``/a/local_map``, are named whole. Names that are
    ``known`` already stay, so that a robot keeps its name when other topics appear.
    """
    new = [topic for topic in topics if topic not in known]
    spaces = {topic: topic.strip("/").rpartition("/")[0].replace("/", "_") for topic in new}
    repeated = {space for space in spaces.values() if list(spaces.values()).count(space) > 1} | set(known.values())
    names = dict(known)
    for topic, space in spaces.items():
        names[topic] = topic.strip("/").replace("/", "_") if space in repeated or not space else space
    return names
