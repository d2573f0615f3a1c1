import random
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32, UInt32

VALUES = [20.0, 21.0, 22.0, 23.0, 24.0, 25.0, 26.0, 27.0, 28.0, 29.0, 30.0]


class MinimalNode(Node):
    def __init__(self):
        super().__init__('node')
        self.publisher_ = self.create_publisher(Float32, 'temperature', 10)
        self.subscription = self.create_subscription(UInt32, 'fan_speed', self.listener_callback, 10)
        self.timer = self.create_timer(0.2, self.timer_callback)

    def timer_callback(self):
        msg = Float32()
        msg.data = random.choice(VALUES)
        self.publisher_.publish(msg)
        self.get_logger().info('Publishing: "%s"' % msg.data)

    def listener_callback(self, msg):
        self.get_logger().info('I heard: "%s"' % msg.data)


def main(args=None):
    rclpy.init(args=args)
    node = MinimalNode()
    rclpy.spin(node)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
