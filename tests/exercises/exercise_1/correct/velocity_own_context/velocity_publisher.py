import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from geometry_msgs.msg import Twist


def main():
    context = Context()
    rclpy.init(context=context)
    node = Node('velocity_publisher', context=context)
    pub = node.create_publisher(Twist, '/cmd_vel', 10)
    msg = Twist()
    msg.linear.x = 0.5
    msg.angular.z = 0.1

    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    node.create_timer(0.05, lambda: pub.publish(msg))
    node.get_logger().info('up')
    while context.ok():
        executor.spin_once(timeout_sec=1.0)


if __name__ == '__main__':
    main()
