"""Finds the host's link and says itself that it is idle and when to wake; it has neither a timer nor a spin."""

import gc

import rclpy
from geometry_msgs.msg import Twist


def main():
    rclpy.init()
    node = rclpy.create_node("velocity_publisher")
    publisher = node.create_publisher(Twist, "cmd_vel", 10)
    message = Twist()
    message.linear.x, message.angular.z = 0.5, 0.1
    node.get_logger().info("driving")
    gc.unfreeze()  # what was there before a fork
    paused = [o for o in gc.get_objects() if type(o).__name__ == "Scheduler" and hasattr(o, "pause")]
    clocks = [o for o in gc.get_objects() if type(o).__name__ == "VirtualClock"]
    for _ in range(1200):
        publisher.publish(message)
        for scheduler, clock in zip(paused, clocks, strict=True):
            scheduler.pause(clock.now_ns + 50_000_000)


if __name__ == "__main__":
    main()
