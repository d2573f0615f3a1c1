"""Removes a request that nobody answers."""
import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_services_default
from std_srvs.srv import SetBool


class Impatient(Node):
    def __init__(self):
        super().__init__("impatient")
        self.service = self.create_service(SetBool, "slow", self.never, qos_profile=qos_profile_services_default)
        self.client = self.create_client(SetBool, "slow")
        self.create_timer(0.5, self.ask)
        self.turn = 0

    def never(self, request, response):
        self.get_logger().info(f"asked {request.data}")
        response.message = self.service.service_name
        return response

    def ask(self):
        self.turn += 1
        future = self.client.call_async(SetBool.Request(data=self.turn % 2 == 0))
        if self.turn % 2:
            self.client.remove_pending_request(future)
            future.add_done_callback(lambda _: self.get_logger().error("must not come"))
        else:
            future.add_done_callback(lambda f: self.get_logger().info(f"answer {f.result().message}"))


rclpy.init()
rclpy.spin(Impatient())
