"""A ROS 2 node of rclpy: sends the maps of an npz file, one topic each, and saves the last merged map that it receives.

    python rclpy_node.py MAPS.npz RECEIVED.npz SECONDS

Each map of the file has ``NAME`` (rows, cols) int8 and ``NAME_origin`` (3,) resolution, x, y.
"""

from __future__ import annotations

import sys
import time

import numpy as np
import rclpy
from nav_msgs.msg import OccupancyGrid
from rclpy.qos import DurabilityPolicy, QoSProfile

maps, received, seconds = sys.argv[1], sys.argv[2], float(sys.argv[3])
rclpy.init()
node = rclpy.create_node("team")
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
content = np.load(maps)
publishers = []
for name in (each for each in content.files if not each.endswith("_origin")):
    message = OccupancyGrid()
    message.header.frame_id = f"{name}/map"
    message.header.stamp.sec = 1
    message.info.height, message.info.width = content[name].shape
    resolution, x, y = content[f"{name}_origin"].tolist()
    message.info.resolution = resolution
    message.info.origin.position.x, message.info.origin.position.y = x, y
    message.data = content[name].ravel().tolist()
    publishers.append((node.create_publisher(OccupancyGrid, f"/{name}/map", latched), message))
latest: list[OccupancyGrid] = []
start, sent, listening = time.monotonic(), 0, False
while (elapsed := time.monotonic() - start) < seconds:
    if elapsed < seconds / 2 and elapsed >= 2.0 * sent:
        for publisher, message in publishers:
            message.data[sent] = -1 if message.data[sent] == 0 else 0  # a new cell, so that a join is confirmed
            publisher.publish(message)
        sent += 1
    if elapsed >= seconds / 2 and not listening:  # late: the merged map must be latched
        node.create_subscription(OccupancyGrid, "/map_merged", latest.append, latched)
        listening = True
    rclpy.spin_once(node, timeout_sec=0.5)
if latest:
    info = latest[-1].info
    cells = np.array(latest[-1].data, np.int8).reshape(info.height, info.width)
    np.savez(received, cells=cells, frame=latest[-1].header.frame_id)
node.destroy_node()
rclpy.shutdown()
