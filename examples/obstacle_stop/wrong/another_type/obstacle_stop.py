"""Drives forward, and stops as long as the laser scanner sees something nearer than half a metre."""

import rclpy
from geometry_msgs.msg import TwistStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import LaserScan

SPEED = 0.3
STOP_DISTANCE = 0.5


class ObstacleStop(Node):
    """Answers each scan with a command."""

    def __init__(self):
        super().__init__("obstacle_stop")
        self.commands = self.create_publisher(TwistStamped, "/cmd_vel", 10)
        self.create_subscription(LaserScan, "/scan", self.on_scan, 10)

    def on_scan(self, scan):
        """Drive if the nearest valid range is large enough."""
        valid = [distance for distance in scan.ranges if scan.range_min <= distance <= scan.range_max]
        command = TwistStamped()
        if min(valid, default=scan.range_max) >= STOP_DISTANCE:
            command.twist.linear.x = SPEED
        self.commands.publish(command)


def main():
    rclpy.init()
    node = ObstacleStop()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
