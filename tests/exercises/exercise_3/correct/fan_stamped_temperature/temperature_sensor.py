import random

import rclpy
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile
from sensor_msgs.msg import Temperature
from std_msgs.msg import Int32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        qos = QoSProfile(depth=1, history=HistoryPolicy.KEEP_LAST)
        self.publisher = self.create_publisher(Temperature, 'temperature', qos)
        self.subscription = self.create_subscription(Int32, 'fan_speed', self.fan_speed_callback, qos)
        self.timer = self.create_timer(1.0 / 5.0, self.timer_callback)

    def timer_callback(self):
        msg = Temperature()
        msg.header.stamp = self.get_clock().now().to_msg()
        msg.header.frame_id = 'motor'
        msg.temperature = 20.0 + 10.0 * random.betavariate(2, 2)
        msg.variance = 0.04
        self.publisher.publish(msg)

    def fan_speed_callback(self, msg: Int32):
        self.get_logger().info(f'Received fan speed: {msg.data} %')


def main(args=None):
    rclpy.init(args=args)
    node = TemperatureSensor()
    rclpy.spin(node)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
