import rclpy
import rclpy.logging
from nav_msgs.msg import Odometry

LOG = rclpy.logging.get_logger('odom')


def heard(msg):
    x = msg.pose.pose.position.x
    y = msg.pose.pose.position.y
    print(f'\r{x:.3f} {y:.3f}', end='')
    LOG.info(f'Robot position: ({x:.3f}, {y:.3f})', throttle_duration_sec=1.0)


def main(args=None):
    rclpy.init(args=args)
    node = rclpy.create_node('odom_subscriber')
    sub = node.create_subscription(Odometry, '/odom', heard, 10)
    rclpy.spin(node)


if __name__ == '__main__':
    main()
