"""A ROS 2 recording in MCAP as a range-bearing CSV for `ptm import`.

    pip install mcap-ros2-support
    python python/examples/from_mcap.py drive.mcap /odom /landmarks > scans.csv

Odometry is nav_msgs/Odometry. What is seen is geometry_msgs/PoseArray or
vision_msgs/Detection3DArray in the frame of the robot: x ahead, y to the left, metres. Messages in
another frame are refused; transform them first. A scan takes the pose of the last odometry.
"""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Iterator
from typing import Any, TextIO


def seconds(stamp: Any) -> float:
    """A stamp of ROS, s."""
    return stamp.sec + 1e-9 * stamp.nanosec


def pose(message: Any) -> tuple[float, float, float]:
    """x and y (m) and heading (rad) of nav_msgs/Odometry."""
    place, turn = message.pose.pose.position, message.pose.pose.orientation
    sine = 2 * (turn.w * turn.z + turn.x * turn.y)
    return place.x, place.y, math.atan2(sine, 1 - 2 * (turn.y**2 + turn.z**2))


def places(message: Any) -> Iterator[Any]:
    """The points that were seen, m."""
    if hasattr(message, "poses"):
        yield from (own.position for own in message.poses)
    else:
        yield from (own.bbox.center.position for own in message.detections)


def convert(recording: str, odometry: str, seen: str, out: TextIO) -> None:
    """Writes a row for each point seen, and a row for each pose from which nothing was."""
    from mcap_ros2.reader import read_ros2_messages

    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(["t", "robot_x", "robot_y", "robot_theta", "range", "bearing"])
    start, now, robot = None, None, None
    for own in read_ros2_messages(recording, topics=[odometry, seen]):
        message = own.ros_msg
        time = seconds(message.header.stamp)
        start = time if start is None else start
        if own.channel.topic == odometry:
            now, robot = pose(message), message.child_frame_id
            rows.writerow([f"{time - start:.6f}", *now, "", ""])
            continue
        frame = message.header.frame_id
        if now is None:
            continue
        if frame != robot:
            sys.exit(f"{seen}: got the frame {frame!r}, expected {robot!r}, that of the robot")
        for place in places(message):
            ahead, left = place.x, place.y
            polar = [math.hypot(ahead, left), math.atan2(left, ahead)]
            rows.writerow([f"{time - start:.6f}", *now, *polar])


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    convert(*sys.argv[1:], sys.stdout)
