"""Counts clients and services, and waits for a node."""
import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Counter(Node):
    def __init__(self):
        super().__init__("counter")
        self.get_logger().info(f"partner: {self.wait_for_node('/partner', 3.0)}")
        self.get_logger().info(f"nobody: {self.wait_for_node('/nobody', 0.5)}")
        self.asking = self.create_client(Trigger, "/count_up")
        self.asking.wait_for_service()
        self.get_logger().info(f"{self.count_clients('/count_up')} {self.count_services('/count_up')}")
        self.get_logger().info(f"{self.asking.service_name} {self.asking.logger_name}")


def main():
    rclpy.init()
    Counter()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
