from random import randint
import rclpy
from rclpy.node import Node
from std_msgs.msg import Int32

class sensor(Node):
    def __init__(self):
        super().__init__("sensor")
        self.p = self.create_publisher(Int32, "temperature", 1)
        self.create_subscription(Int32, "fan_speed", self.fan, 1)
        self.create_timer(1/5, self.tick)

    def tick(self):
        self.p.publish(Int32(data=randint(20, 30)))

    def fan(self, m):
        self.get_logger().info("fan now at %d%%" % m.data)

def main():
    rclpy.init()
    rclpy.spin(sensor())
