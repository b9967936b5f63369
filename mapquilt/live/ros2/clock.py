"""Clocks of a live merge: that of the machine, and the simulated one of ``/clock``."""

from __future__ import annotations

from collections.abc import Callable

from mapquilt.live.ros2.network import Network, Quality

Clock = Callable[[], float | None]
"""Return the time [s], None as long as it is not known."""

CLOCK_TYPE = "rosgraph_msgs/msg/Clock"


class SimulatedClock:
    """The time that a simulator or a bag sends on ``/clock``, as with ``use_sim_time`` of a ROS node.

    The reader asks for nothing, so that it hears every publisher.
    """

    def __init__(self, network: Network) -> None:
        self._reader = network.subscribe("/clock", CLOCK_TYPE, Quality(reliable=False, latched=False), depth=1)
        self._now: float | None = None

    def __call__(self) -> float | None:
        """Return the last time that was heard [s]."""
        for message in self._reader.take():
            if message is not None:
                self._now = message.clock.sec + 1e-9 * message.clock.nanosec
        return self._now
