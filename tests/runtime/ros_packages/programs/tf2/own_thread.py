"""A script whose listener has a thread of its own: it looks at times of the past and describes the tree."""

import time

import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.time import Time
from tf2_ros import Buffer, TransformBroadcaster, TransformListener


def main():
    rclpy.init()
    sender, node = rclpy.create_node("sender"), rclpy.create_node("script")
    broadcaster, buffer = TransformBroadcaster(sender), Buffer(node=node)
    listener = TransformListener(buffer, node, spin_thread=True)
    stamps = []
    for n in range(200):
        t = TransformStamped()
        t.header.stamp = sender.get_clock().now().to_msg()
        t.header.frame_id, t.child_frame_id = "odom", "base_link"
        t.transform.translation.x = float(n)
        t.transform.rotation.w = 1.0
        broadcaster.sendTransform(t)
        stamps.append((n, Time.from_msg(t.header.stamp)))
        time.sleep(0.05)
        if n > 10 and buffer.can_transform("odom", "base_link", stamps[-5][1]):
            break
    (one, first), (_, second) = stamps[-5], stamps[-4]
    middle = Time(nanoseconds=(first.nanoseconds + second.nanoseconds) // 2, clock_type=first.clock_type)
    found = buffer.lookup_transform("odom", "base_link", middle, timeout=Duration(seconds=1.0))
    node.get_logger().info(f"half a step further: {found.transform.translation.x - one:.2f}")
    node.get_logger().info(buffer.all_frames_as_string().strip())
    rclpy.shutdown()


main()

# logs: half a step further: 0.50
# logs: Frame base_link exists with parent odom.
