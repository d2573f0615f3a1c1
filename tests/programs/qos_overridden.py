"""Lets parameters override the depth and the reliability of its publisher."""
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos_overriding_options import QoSOverridingOptions
from std_msgs.msg import String


class Overridden(Node):
    def __init__(self):
        name = "qos_overrides./words.publisher"
        super().__init__(
            "overridden",
            parameter_overrides=[Parameter(f"{name}.reliability", value="best_effort"), Parameter(f"{name}.depth", value=3)],
        )
        self.out = self.create_publisher(
            String, "words", 10, qos_overriding_options=QoSOverridingOptions.with_default_policies()
        )
        for parameter in ("reliability", "depth", "history"):
            self.get_logger().info(f"{parameter}: {self.get_parameter(f'{name}.{parameter}').value}")
        self.create_timer(0.8, lambda: self.out.publish(String(data="word")))


rclpy.init()
rclpy.spin(Overridden())
