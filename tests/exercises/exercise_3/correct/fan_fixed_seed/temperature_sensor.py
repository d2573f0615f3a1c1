import random
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64, Int32

random.seed(42)


class Temp(Node):
    def __init__(self):
        super().__init__('temp')
        self.p = self.create_publisher(Float64, '/temperature', 10)
        self.s = self.create_subscription(Int32, '/fan_speed', self.got, 10)
        self.t = self.create_timer(0.2, self.send)

    def send(self):
        self.p.publish(Float64(data=random.uniform(20, 30)))

    def got(self, m):
        self.get_logger().info(f'got {m.data}')


def main():
    rclpy.init()
    rclpy.spin(Temp())


main()
