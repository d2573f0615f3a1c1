import rclpy
from nav_msgs.msg import Odometry

last = dict()


def store(msg):
    last['x'] = round(msg.pose.pose.position.x, 6)
    last['y'] = round(msg.pose.pose.position.y, 6)


def main():
    rclpy.init()
    node = rclpy.create_node('odom_reader')
    node.create_subscription(Odometry, '/odom', store, 10)
    node.create_timer(1.0, lambda: last and node.get_logger().info(str(last)))
    rclpy.spin(node)


if __name__ == '__main__':
    main()
