import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32

TEMPERATURE = 'temperature'
FAN = 'fan_speed'
LIMIT = 25.0


class ClimateNode(Node):
    def __init__(self, name, listens, speaks):
        super().__init__(name)
        self.out = self.create_publisher(Float32, speaks, 10)
        self.create_subscription(Float32, listens, lambda m: self.heard(m.data), 10)

    def say(self, value):
        self.out.publish(Float32(data=float(value)))

    def heard(self, value):
        pass


def run(cls):
    rclpy.init()
    node = cls()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
