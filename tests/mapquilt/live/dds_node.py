"""A robot without ROS that obeys the lines of its standard input, and answers each with a line.

    python dds_node.py DOMAIN

- ``send ROBOT STEP [x y yaw]``: publish the map that a robot has after some steps, as if it had started in this frame.
"""

from __future__ import annotations

import sys

from mapping.geometry.similarity2 import Similarity2
from mapquilt.convert.ros_messages import occupancy_grid
from mapquilt.live.received_map import grid_of
from mapquilt.live.ros2.network import LATCHED, Network
from tests.mapquilt.live.test_live_merger import sent

network = Network(int(sys.argv[1]))
print("ready", flush=True)
for line in sys.stdin:
    _, robot, step, *frame = line.split()
    message = sent(robot, int(step), Similarity2(*map(float, frame)) if frame else None)
    network.publish(f"/{robot}/map", occupancy_grid(grid_of(message), message.stamp, message.frame), LATCHED)
    print("done", flush=True)
