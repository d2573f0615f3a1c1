import numpy as np
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist

COMMAND = np.array([[0.5, 0.0, 0.0], [0.0, 0.0, 0.1]])


class NumpyPublisher(Node):
    def __init__(self):
        super().__init__('numpy_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(np.divide(1.0, 20), self.publish_array)

    def publish_array(self):
        msg = Twist()
        for part, values in zip((msg.linear, msg.angular), COMMAND):
            for axis, value in zip('xyz', values):
                setattr(part, axis, value)
        self.pub.publish(msg)
        self.get_logger().info(f'{COMMAND.tolist()}')


def main():
    rclpy.init()
    node = NumpyPublisher()
    rclpy.spin(node)


if __name__ == '__main__':
    main()
