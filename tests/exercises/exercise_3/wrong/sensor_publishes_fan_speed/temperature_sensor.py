"""Stands in for a thermometer: five random temperatures a second, and an ear for what the fan does about them."""

import random

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float32, String

PERIOD_S = 0.2
COLDEST_C = 20.0
HOTTEST_C = 30.0


class TemperatureSensor(Node):
    """Publishes on /temperature and logs what comes back on /fan_speed."""

    def __init__(self):
        super().__init__("temperature_sensor")
        self.publisher = self.create_publisher(Float32, "/temperature", 10)
        self.fan = self.create_publisher(String, "/fan_speed", 10)
        self.create_timer(PERIOD_S, self.measure)

    def measure(self):
        """Publish one random temperature."""
        self.publisher.publish(Float32(data=random.uniform(COLDEST_C, HOTTEST_C)))
        self.fan.publish(String(data="on"))


def main(args=None):
    """Run the node until Ctrl-C."""
    rclpy.init(args=args)
    node = TemperatureSensor()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
