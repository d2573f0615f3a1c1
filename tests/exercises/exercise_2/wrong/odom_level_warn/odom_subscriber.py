import rclpy
import rclpy.logging
from nav_msgs.msg import Odometry


def main():
    rclpy.init()
    node = rclpy.create_node('odom_sub')
    rclpy.logging.set_logger_level('odom_sub', rclpy.logging.LoggingSeverity.WARN)
    latest = []

    def remember(msg):
        latest[:] = [msg.pose.pose.position]

    def show():
        if latest:
            node.get_logger().info(f'x={latest[0].x:.2f} y={latest[0].y:.2f}')

    node.create_subscription(Odometry, 'odom', remember, 10)
    node.create_timer(1.0, show)
    rclpy.spin(node)


if __name__ == '__main__':
    main()
