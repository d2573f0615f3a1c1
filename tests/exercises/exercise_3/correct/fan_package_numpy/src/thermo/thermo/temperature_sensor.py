import numpy as np
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32, Int32


class TemperatureSensor(Node):

    def __init__(self):
        super().__init__('temperature_sensor')
        self.last_speed = None
        self.publisher = self.create_publisher(Float32, 'temperature', 10)
        self.subscription = self.create_subscription(Int32, 'fan_speed', self.fan_speed_callback, 10)
        self.timer = self.create_timer(0.2, self.timer_callback)

    def timer_callback(self):
        msg = Float32()
        msg.data = float(np.random.uniform(20.0, 30.0))
        self.publisher.publish(msg)

    def fan_speed_callback(self, msg):
        if msg.data != self.last_speed:
            self.get_logger().info('fan speed changed to "%d"' % msg.data)
            self.last_speed = msg.data


def main(args=None):
    rclpy.init(args=args)
    node = TemperatureSensor()
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0.1)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
