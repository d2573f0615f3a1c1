"""Exercise 3, node B: switch a fan by the temperature."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

# TODO: import the message types that your temperature_sensor.py uses.


class FanController(Node):
    """Subscribes to /temperature and publishes on /fan_speed."""

    def __init__(self):
        super().__init__("fan_controller")

        # TODO: subscribe to /temperature.
        # TODO: publish 100 on /fan_speed when it is above 25 degrees Celsius, and 0 when it is not.


def main(args=None):
    rclpy.init(args=args)
    node = FanController()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
