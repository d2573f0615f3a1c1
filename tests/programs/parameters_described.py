"""Declares parameters with descriptors and prints what they are, like a `ros2 param describe` of its own."""
import rclpy
from rcl_interfaces.msg import IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter


class Settings(Node):
    def __init__(self):
        super().__init__("settings")
        limits = IntegerRange(from_value=0, to_value=10, step=2)
        self.declare_parameter("speed", 4, ParameterDescriptor(description="how fast", integer_range=[limits]))
        self.declare_parameter("robot.name", "turtle", ParameterDescriptor(read_only=True))
        self.create_timer(1.0, self.show)

    def show(self):
        told = self.describe_parameter("speed")
        self.get_logger().info(f"{told.name}: {told.description}, up to {told.integer_range[0].to_value}")
        for told in self.describe_parameters(["speed", "robot.name"]):
            self.get_logger().info(f"{told.name} read only: {told.read_only}")
        for value in (6, 7, 12):
            result = self.set_parameters([Parameter("speed", value=value)])[0]
            self.get_logger().info(f"{value}: {result.successful}")
        self.set_descriptor("speed", ParameterDescriptor(description="now without limits"), alternative_value=Parameter("speed", value=8).get_parameter_value())
        self.get_logger().info(f"{self.describe_parameter('speed').description} {self.get_parameter('speed').value}")
        raise SystemExit


rclpy.init()
rclpy.spin(Settings())
