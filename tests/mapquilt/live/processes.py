"""Processes on the loopback interface, which know of one another by DDS alone."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mapquilt.live.ros2.network import LATCHED, STREAM, Network, Subscription

GRID = "nav_msgs/msg/OccupancyGrid"
LOOPBACK = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces></General>'
    "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>60</MaxAutoParticipantIndex>"
    '<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)
DOMAIN = 1 + os.getpid() % 100
"""So that the workers of one machine do not hear one another; ports of domains above 101 may be taken on Linux."""


class Process:
    """A process whose output is read as it comes."""

    def __init__(self, *words: object, **environment: str) -> None:
        self._process = subprocess.Popen(
            [str(word) for word in words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**environment, "PYTHONUNBUFFERED": "1"},
        )
        self._lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        self._lines.extend(self._process.stdout)

    @property
    def output(self) -> str:
        return "".join(self._lines)

    def says(self, *texts: str, seconds: float = 60.0) -> bool:
        """Wait until the output holds these texts."""
        return wait_for(lambda: all(text in self.output for text in texts), seconds) or False

    def tell(self, line: str) -> None:
        """Send a line, and wait for a line of answer."""
        said = len(self._lines)
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()
        assert wait_for(lambda: len(self._lines) > said or self._process.poll() is not None), self.output
        assert self._process.poll() is None, self.output

    def close(self) -> None:
        """Close the standard input."""
        self._process.stdin.close()

    def send(self, number: signal.Signals) -> None:
        self._process.send_signal(number)

    def end(self, number: signal.Signals | None = signal.SIGINT, seconds: float = 120.0) -> int:
        """Send a signal, wait for the end, and return the exit status."""
        if number is not None and self._process.poll() is None:
            self._process.send_signal(number)
        status = self._process.wait(timeout=seconds)
        self._reader.join()
        return status


class Processes:
    """Start processes, and kill those that still run when a test ends."""

    def __init__(self) -> None:
        self._all: list[Process] = []

    def command(self, *arguments: object, **environment: str) -> Process:
        """Start the command line."""
        words = (sys.executable, "-m", "mapquilt", *arguments, "--domain", DOMAIN)
        return self._started(Process(*words, **{**os.environ, "CYCLONEDDS_URI": LOOPBACK, **environment}))

    def node(self, python: str, script: object, maps: object, home: object) -> Process:
        """Start a node of rclpy, and wait until it is ready."""
        node = Process(
            python,
            script,
            maps,
            ROS_DOMAIN_ID=str(DOMAIN),
            RMW_IMPLEMENTATION="rmw_fastrtps_cpp",
            ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST",
            ROS_LOG_DIR=str(home),
            HOME=str(home),
            PATH=os.environ["PATH"],
        )
        assert node.says("ready"), node.output
        return self._started(node)

    def dds_node(self) -> Process:
        """Start a robot without ROS, and wait until it is ready."""
        words = (sys.executable, Path(__file__).with_name("dds_node.py"), DOMAIN)
        node = Process(*words, **{**os.environ, "CYCLONEDDS_URI": LOOPBACK, "PYTHONPATH": os.pathsep.join(sys.path)})
        assert node.says("ready"), node.output
        return self._started(node)

    def kill(self) -> None:
        for process in self._all:
            process.end(signal.SIGKILL)

    def _started(self, process: Process) -> Process:
        self._all.append(process)
        return process


class Diagnostics:
    """The last diagnostics of a merger, as they come."""

    def __init__(self, network: Network, topic: str = "/mapquilt/diagnostics") -> None:
        self._reader: Subscription = network.subscribe(topic, "diagnostic_msgs/msg/DiagnosticArray", STREAM)
        self.stamp, self.status = 0.0, {}

    def look(self) -> dict[str, tuple[str, dict[str, str]]]:
        """Return the message and the values of each status by its name."""
        for each in self._reader.take():
            self.stamp = each.header.stamp.sec + 1e-9 * each.header.stamp.nanosec
            self.status = {
                one.name.removeprefix("mapquilt: "): (one.message, {pair.key: pair.value for pair in one.values})
                for one in each.status
            }
        return self.status

    def value(self, name: str, key: str) -> str | None:
        return self.look().get(name, ("", {}))[1].get(key)


def wait_for(found: Callable[[], Any], seconds: float = 60.0) -> Any:
    """Return the first result that is not empty; None if there is none in time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if result := found():
            return result
        time.sleep(0.02)
    return None


def is_published(network: Network, topic: str) -> bool:
    return any(each.topic == topic for each in network.publishers().values())


def transforms(network: Network, seconds: float = 10.0) -> dict[str, Any]:
    """Collect the transforms on tf and tf_static, by child frame, until each topic was heard."""
    kind, found = "tf2_msgs/msg/TFMessage", {}
    for topic, quality in (("/tf_static", LATCHED), ("/tf", STREAM)):
        reader = network.subscribe(topic, kind, quality)
        for each in wait_for(lambda reader=reader: list(reader.take()), seconds) or ():
            found |= {one.child_frame_id: one for one in each.transforms}
    return found
