"""Passes the commands of a driver on to the robot, and brakes as long as something is too near ahead."""

import rclpy
from geometry_msgs.msg import Twist
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import LaserScan

AHEAD = 0.5
MARGIN = 0.35
REACTION = 0.8


class EmergencyBrake(Node):
    """Answers each command of the driver with one to the robot."""

    def __init__(self):
        super().__init__("emergency_brake")
        self.nearest = 0.0
        self.braked = False
        self.commands = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_subscription(LaserScan, "/scan", self.on_scan, 10)
        self.create_subscription(Twist, "/driver/cmd_vel", self.on_command, 10)

    def on_scan(self, scan):
        """Keep the nearest valid range in front of the robot."""
        found = []
        for number, distance in enumerate(scan.ranges):
            angle = scan.angle_min + number * scan.angle_increment
            if abs(angle) <= AHEAD and scan.range_min <= distance <= scan.range_max:
                found.append(distance)
        self.nearest = min(found, default=scan.range_max)

    def on_command(self, wanted):
        """Drive as the driver wants, unless the robot could not stop in time."""
        command = Twist()
        command.angular.z = wanted.angular.z
        if 0.0 < self.nearest <= MARGIN + REACTION * wanted.linear.x:
            self.braked = True
        if self.nearest > 0.0 and not self.braked:
            command.linear.x = wanted.linear.x
        self.commands.publish(command)


def main():
    rclpy.init()
    node = EmergencyBrake()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
