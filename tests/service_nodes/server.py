"""A battery whose percentage falls with each question."""

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Battery(Node):
    def __init__(self):
        super().__init__("battery")
        self.percentage = 85.0
        self.create_service(Trigger, "/battery/get_status", self.answer)

    def answer(self, request, response):
        response.success = True
        response.message = f"Battery: {self.percentage:.1f}% remaining"
        self.get_logger().info(response.message)
        self.percentage -= 0.5
        return response


def main():
    rclpy.init()
    rclpy.spin(Battery())


if __name__ == "__main__":
    main()
