"""Logs what is said on /topic."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class Listener(Node):
    """Logs each text that it hears."""

    def __init__(self):
        super().__init__("listener")
        self.create_subscription(String, "topic", self.on_text, 10)

    def on_text(self, message):
        """Log a text."""
        self.get_logger().info(f"I heard: {message.data!r}")


def main(args=None):
    """Run the node until Ctrl-C."""
    rclpy.init(args=args)
    node = Listener()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
