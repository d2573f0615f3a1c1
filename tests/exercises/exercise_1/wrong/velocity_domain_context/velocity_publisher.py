import rclpy
from geometry_msgs.msg import Twist
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor


def main():
    context = Context()
    rclpy.init(context=context, domain_id=3)
    node = rclpy.create_node('velocity', context=context)
    pub = node.create_publisher(Twist, '/cmd_vel', 10)
    command = Twist()
    command.linear.x = 0.5
    command.angular.z = 0.1
    node.create_timer(0.05, lambda: pub.publish(command))
    node.get_logger().info('velocity node started')
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    executor.spin()


if __name__ == '__main__':
    main()
