"""Looks at the parameters of the node beside it, changes them, and tries to delete one."""
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient


class Remote(Node):
    def __init__(self):
        super().__init__("remote")
        self.client = AsyncParameterClient(self, "partner")

    def ask(self, future):
        rclpy.spin_until_future_complete(self, future)
        return future.result()

    def run(self):
        while not self.client.services_are_ready():
            rclpy.spin_once(self, timeout_sec=0.1)
        names = self.ask(self.client.list_parameters(["size"], 1)).result.names
        self.get_logger().info(str(names))
        self.get_logger().info(str(list(self.ask(self.client.get_parameter_types(["size", "none"])).types)))
        told = self.ask(self.client.describe_parameters(["size"])).descriptors[0]
        self.get_logger().info(f"{told.name} {told.type}")
        done = self.ask(self.client.set_parameters_atomically([Parameter("size", value=8)]))
        self.get_logger().info(str(done.result.successful))
        gone = self.ask(self.client.delete_parameters(["size"])).results[0]
        self.get_logger().info(str(gone.successful))


rclpy.init()
Remote().run()
