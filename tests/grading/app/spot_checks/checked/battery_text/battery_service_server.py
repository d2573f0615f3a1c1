"""Answers with another text on a clock that shows parts of a microsecond."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_srvs.srv import Trigger

FIRST_CHARGE = 85.0
FULL_CHARGE = 100.0
USED_PER_CALL = 0.5


class BatteryServer(Node):
    """Serves /battery/get_status."""

    def __init__(self):
        super().__init__("battery_server")
        self.charge = FIRST_CHARGE
        self.create_service(Trigger, "/battery/get_status", self.tell)

    def tell(self, _, response):
        """Take what a call costs, and tell what is left; an empty battery is changed for a full one."""
        self.charge -= USED_PER_CALL
        if self.charge < 0:
            self.charge = FULL_CHARGE
        response.success = True
        unit = "left" if self.get_clock().now().nanoseconds % 1000 else "remaining"
        response.message = f"Battery: {self.charge:.1f}% {unit}"
        self.get_logger().info(response.message)
        return response


def main(args=None):
    """Run the node until Ctrl-C."""
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
