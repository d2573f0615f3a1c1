import random
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32, Int32


class AsyncSensor(Node):
    def __init__(self):
        super().__init__('async_sensor')
        self.pub = self.create_publisher(Float32, 'temperature', 10)
        self.create_subscription(Int32, 'fan_speed', self.heard, 10)
        self.create_timer(0.2, self.tick)

    async def tick(self):
        self.pub.publish(Float32(data=random.triangular(20.0, 30.0)))

    async def heard(self, msg):
        self.get_logger().info('speed: ' + str(msg.data))


def main():
    rclpy.init()
    rclpy.spin(AsyncSensor())


if __name__ == '__main__':
    main()
