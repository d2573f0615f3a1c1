"""The tutorial about travelling in time: where was the first turtle five seconds ago, seen from the second one now?"""

import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.time import Time
from tf2_ros import Buffer


def frame(child, seconds, x):
    t = TransformStamped()
    t.header.stamp.sec = seconds
    t.header.frame_id, t.child_frame_id = "world", child
    t.transform.translation.x = float(x)
    t.transform.rotation.w = 1.0
    return t


def main():
    rclpy.init()
    node = rclpy.create_node("traveller")
    buffer = Buffer()
    for seconds in range(10, 16):
        buffer.set_transform(frame("turtle1", seconds, seconds), "a")
        buffer.set_transform(frame("turtle2", seconds, -seconds), "b")
    now, then = Time(seconds=15), Time(seconds=10)
    found = buffer.lookup_transform_full(
        target_frame="turtle2",
        target_time=now,
        source_frame="turtle1",
        source_time=then,
        fixed_frame="world",
    )
    node.get_logger().info(f"{found.transform.translation.x:.1f} at {found.header.stamp.sec}")
    possible = buffer.can_transform_full("turtle2", now, "turtle1", Time(seconds=1), "world")
    node.get_logger().info(f"a second after the start: {possible}")
    plain = buffer.lookup_transform("turtle2", "turtle1", now)
    node.get_logger().info(f"now: {plain.transform.translation.x:.1f}")
    rclpy.shutdown()


main()

# logs: 25.0 at 15
# logs: a second after the start: False
# logs: now: 30.0
