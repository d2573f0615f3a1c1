"""Drives forward at 20 commands a second, and stops while the laser scanner sees something nearer than a distance."""

import rclpy
from geometry_msgs.msg import Twist
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import LaserScan


class ObstacleStop(Node):
    """Remembers the nearest reading of the last scan."""

    def __init__(self):
        super().__init__("obstacle_stop")
        self.distance = self.declare_parameter("distance", 1.0).value
        self.nearest = 0.0
        self.commands = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_subscription(LaserScan, "/scan", self.on_scan, 10)
        self.create_timer(0.05, self.on_timer)

    def on_scan(self, scan):
        """Remember the nearest reading."""
        self.nearest = min(scan.ranges)

    def on_timer(self):
        """Send a command."""
        command = Twist()
        command.linear.x = 0.2 if self.nearest > self.distance else 0.0
        self.commands.publish(command)


def main():
    """Run the node until Ctrl-C."""
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
