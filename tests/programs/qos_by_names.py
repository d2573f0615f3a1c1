"""Reads the QoS from texts, as from a configuration file."""
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int32


class Configured(Node):
    def __init__(self):
        super().__init__("configured")
        self.get_logger().info(f"{sorted(ReliabilityPolicy.short_keys())}")
        qos = QoSProfile(
            depth=5,
            history=HistoryPolicy.get_from_short_key("keep_last"),
            reliability=ReliabilityPolicy.get_from_short_key("BEST_EFFORT"),
            durability=DurabilityPolicy.get_from_short_key("volatile"),
            liveliness=LivelinessPolicy.AUTOMATIC,
        )
        self.get_logger().info(f"{qos.reliability.short_key} {qos.liveliness.name} {qos.depth}")
        self.out = self.create_publisher(Int32, "numbers", qos)
        self.sent = 0
        self.create_timer(0.5, self.send)

    def send(self):
        self.sent += 1
        self.out.publish(Int32(data=self.sent))


rclpy.init()
rclpy.spin(Configured())
