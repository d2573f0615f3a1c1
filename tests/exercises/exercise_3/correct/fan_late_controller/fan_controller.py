import time
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.get_logger().info('calibrating the fan')
        time.sleep(3.0)
        self.pub = self.create_publisher(Float32, '/fan_speed', 10)
        self.sub = self.create_subscription(Float32, '/temperature', self.control, 10)

    def control(self, msg):
        self.pub.publish(Float32(data=100.0 if msg.data > 25.0 else 0.0))


def main():
    rclpy.init()
    rclpy.spin(FanController())


if __name__ == '__main__':
    main()
