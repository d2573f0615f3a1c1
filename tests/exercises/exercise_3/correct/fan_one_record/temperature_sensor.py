import random
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class SensorNode(Node):
    def __init__(self):
        super().__init__('sensor_node')
        self.temp = 0.0
        self.pub = self.create_publisher(Float32, '/temperature', 10)
        self.sub = self.create_subscription(Float32, '/fan_speed', self.fan_cb, 10)
        self.timer = self.create_timer(0.2, self.temp_cb)

    def temp_cb(self):
        self.temp = random.uniform(20.0, 30.0)
        self.pub.publish(Float32(data=self.temp))

    def fan_cb(self, msg):
        self.get_logger().info('T=%.1f fan=%.1f' % (self.temp, msg.data))


def main():
    rclpy.init()
    rclpy.spin(SensorNode())


if __name__ == '__main__':
    main()
