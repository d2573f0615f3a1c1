"""Project 3: tell the charge of a battery."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

# TODO: import the service type.


class BatteryServer(Node):
    """Serves /battery/get_status."""

    def __init__(self):
        super().__init__("battery_server")

        # TODO: create the service /battery/get_status, type std_srvs/srv/Trigger.
        # TODO: the charge starts at 85.0 percent and loses 0.5 with each call; below 0 it starts again at 100.0.
        # TODO: answer success and the message 'Battery: 84.5% remaining', with the charge that is left.


def main(args=None):
    rclpy.init(args=args)
    node = BatteryServer()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
