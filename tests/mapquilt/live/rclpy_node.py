"""A ROS 2 node of rclpy that obeys the lines of its standard input, and answers each with a line.

    python rclpy_node.py MAPS.npz

- ``send KEY``: publish the map KEY, ``ROBOT:NUMBER``, of the file on the topic /ROBOT/map, reliable and latched;
- ``listen TOPIC``: subscribe to an OccupancyGrid, reliable and latched;
- ``save FILE``: take what came, wait for a message if none did, and save the last one as an npz file.

Each map of MAPS.npz has ``KEY`` (rows, cols) int8 and ``KEY:place`` (3,): resolution, x and y of the origin.
"""

from __future__ import annotations

import sys

import numpy as np
import rclpy
from nav_msgs.msg import OccupancyGrid
from rclpy.qos import DurabilityPolicy, QoSProfile

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def message_of(key: str) -> OccupancyGrid:
    message = OccupancyGrid()
    message.header.frame_id = f"{key.partition(':')[0]}/map"
    message.header.stamp.sec = 1
    message.info.height, message.info.width = content[key].shape
    resolution, x, y = content[f"{key}:place"].tolist()
    message.info.resolution = resolution
    message.info.origin.position.x, message.info.origin.position.y = x, y
    message.data = content[key].ravel().tolist()
    return message


content = np.load(sys.argv[1])
rclpy.init()
node = rclpy.create_node("team")
publishers: dict[str, object] = {}
latest: list[OccupancyGrid] = []
print("ready", flush=True)
for line in sys.stdin:
    verb, argument = line.split()
    if verb == "send":
        topic = f"/{argument.partition(':')[0]}/map"
        if topic not in publishers:
            publishers[topic] = node.create_publisher(OccupancyGrid, topic, LATCHED)
        publishers[topic].publish(message_of(argument))
    elif verb == "listen":
        node.create_subscription(OccupancyGrid, argument, latest.append, LATCHED)
    else:
        while not latest:
            rclpy.spin_once(node, timeout_sec=0.1)
        rclpy.spin_once(node, timeout_sec=1.0)
        info = latest[-1].info
        cells = np.array(latest[-1].data, np.int8).reshape(info.height, info.width)
        np.savez(argument, cells=cells, frame=latest[-1].header.frame_id)
    print("done", flush=True)
node.destroy_node()
rclpy.shutdown()
