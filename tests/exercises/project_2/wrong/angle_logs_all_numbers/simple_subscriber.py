import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class SimpleSubscriber(Node):
    def __init__(self):
        super().__init__('simple_subscriber')
        self.create_subscription(Float64, '/joint_commands', self.listener_callback, 10)

    def listener_callback(self, msg):
        self.get_logger().info('radians: ' + ' '.join(f'{n / 10:.1f}' for n in range(-32, 33)))
        for low in range(-180, 180, 90):
            self.get_logger().info('degrees: ' + ' '.join(str(n) for n in range(low, low + 90)))


def main():
    rclpy.init()
    rclpy.spin(SimpleSubscriber())


if __name__ == '__main__':
    main()
