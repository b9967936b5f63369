"""Topics of maps, and the robots that they are of."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

MAP_TYPE = "nav_msgs/msg/OccupancyGrid"
UPDATE_TYPE = "map_msgs/msg/OccupancyGridUpdate"
UPDATES = "_updates"
"""Ending of the topic on which a map's updates come."""


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


def robot_names(topics: Iterable[str]) -> dict[str, str]:
    """Name the robot of each topic by its namespace: ``/robot_0/map`` is of ``robot_0``.

    Topics whose namespaces are the same, such as ``/map`` and ``/local_map``, are named whole.
    """
    spaces = {topic: topic.strip("/").rpartition("/")[0].replace("/", "_") for topic in topics}
    repeated = {space for space in spaces.values() if list(spaces.values()).count(space) > 1}
    return {
        topic: topic.strip("/").replace("/", "_") if space in repeated or not space else space
        for topic, space in spaces.items()
    }
