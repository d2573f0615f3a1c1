import rclpy
import rclpy.logging
from rclpy.node import Node
from geometry_msgs.msg import Twist

logger = rclpy.logging.get_logger('velocity')


class V(Node):
    def __init__(self):
        Node.__init__(self, 'v')
        self.out = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.05, self.pub)

    def pub(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.out.publish(msg)
        logger.info('published', throttle_duration_sec=1)


def main():
    rclpy.init()
    v = V()
    rclpy.spin(v)


if __name__ == '__main__':
    main()
