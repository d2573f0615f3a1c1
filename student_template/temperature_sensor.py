"""Exercise 3, node A: publish random temperatures and log the fan speed."""

import random  # noqa: F401 - you will need it

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

# TODO: import a message type for /temperature and one for /fan_speed; both of your nodes must use the same ones.


class TemperatureSensor(Node):
    """Publishes on /temperature, five times a second, and subscribes to /fan_speed."""

    def __init__(self):
        super().__init__("temperature_sensor")

        # TODO: publish a random temperature from 20 to 30 degrees Celsius on /temperature at 5 Hz.
        # TODO: subscribe to /fan_speed and log each value that arrives.


def main(args=None):
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
