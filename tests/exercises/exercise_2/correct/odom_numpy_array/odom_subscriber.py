import numpy as np
import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class NumpyOdom(Node):
    def __init__(self):
        super().__init__('numpy_odom')
        self.position = np.full(2, np.nan)
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.log)

    def cb(self, msg):
        p = msg.pose.pose.position
        self.position = np.array([p.x, p.y])

    def log(self):
        if not np.isnan(self.position).any():
            self.get_logger().info('Position: ' + str(np.round(self.position, 3)))


def main():
    rclpy.init()
    rclpy.spin(NumpyOdom())


if __name__ == '__main__':
    main()
