import rclpy
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from geometry_msgs.msg import Twist

PERIOD = Duration(nanoseconds=50_000_000)


def main(args=None):
    rclpy.init(args=args)
    node = Node('velocity_publisher')
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    publisher = node.create_publisher(Twist, '/cmd_vel', 10)
    message = Twist()
    message.linear.x = 0.5
    message.angular.z = 0.1
    due = node.get_clock().now()
    sent = 0
    while rclpy.ok():
        if (left := due - node.get_clock().now()) > Duration():
            executor.spin_once(timeout_sec=left.nanoseconds * 1e-9)
            continue
        publisher.publish(message)
        due += PERIOD
        if not sent % 20:
            node.get_logger().info(f'command {sent}')
        sent += 1


if __name__ == '__main__':
    try:
        main()
    except KeyboardInterrupt:
        pass
