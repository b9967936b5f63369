"""Topics by which other nodes steer a live merge.

PREFIX/freeze    std_msgs/Bool: hold all poses, or let them follow the maps again
PREFIX/record    std_msgs/Empty: write the merge of now
"""

from __future__ import annotations

from mapquilt.live.ros2.network import Network, Quality
from mapquilt.live.topics import Names

FREEZE_TYPE, RECORD_TYPE = "std_msgs/msg/Bool", "std_msgs/msg/Empty"


class Controls:
    """Readers of these topics, which ask for nothing, so that they hear every publisher."""

    def __init__(self, network: Network, names: Names) -> None:
        anything = Quality(reliable=False, latched=False)
        self._freeze = network.subscribe(f"{names.prefix}/freeze", FREEZE_TYPE, anything)
        self._record = network.subscribe(f"{names.prefix}/record", RECORD_TYPE, anything)

    def freeze(self) -> bool | None:
        """Return the last wish that came since; None without one."""
        wishes = [bool(message.data) for message in self._freeze.take() if message is not None]
        return wishes[-1] if wishes else None

    def record(self) -> bool:
        """Check if a record was asked for since."""
        return any(message is not None for message in self._record.take())
