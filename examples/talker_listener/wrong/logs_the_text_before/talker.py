"""Says hello twice a second, and counts."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class Talker(Node):
    """Publishes a numbered greeting on /topic."""

    def __init__(self):
        super().__init__("talker")
        self.publisher = self.create_publisher(String, "topic", 10)
        self.create_timer(0.5, self.greet)
        self.count = 0

    def greet(self):
        """Publish the next greeting."""
        greeting = String()
        greeting.data = f"Hello World: {self.count}"
        self.publisher.publish(greeting)
        self.get_logger().info(f"published {greeting.data!r}")
        self.count += 1


def main(args=None):
    """Run the node until Ctrl-C."""
    rclpy.init(args=args)
    node = Talker()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
