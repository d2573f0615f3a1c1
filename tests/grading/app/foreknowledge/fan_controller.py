"""Runs a fan at full speed while it is warmer than 25 degrees Celsius, and stops it otherwise."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float32

LIMIT_C = 25.0
FULL_SPEED = 100.0
STOPPED = 0.0


class FanController(Node):
    """Answers each message on /temperature with one on /fan_speed."""

    def __init__(self):
        super().__init__("fan_controller")
        self.publisher = self.create_publisher(Float32, "/fan_speed", 10)
        self.create_subscription(Float32, "/temperature", self.control, 10)

    def control(self, msg):
        """Publish the fan speed that a temperature asks for; the limit itself needs no fan."""
        speed = FULL_SPEED if msg.data > LIMIT_C else STOPPED
        self.publisher.publish(Float32(data=speed))


def main(args=None):
    """Run the node until Ctrl-C."""
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
