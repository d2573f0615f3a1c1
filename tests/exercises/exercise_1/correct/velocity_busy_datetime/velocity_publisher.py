from datetime import datetime, timedelta
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


def main(args=None):
    rclpy.init(args=args)
    node = Node('velocity_publisher')
    publisher = node.create_publisher(Twist, '/cmd_vel', 10)
    step = timedelta(milliseconds=50)
    last = datetime.now()
    while rclpy.ok():
        if datetime.now() - last >= step:
            last += step
            message = Twist()
            message.linear.x = 0.5
            message.angular.z = 0.1
            publisher.publish(message)
            node.get_logger().info('Publishing at ' + str(last.time()))


if __name__ == '__main__':
    main()
