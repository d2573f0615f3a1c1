import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.publisher = self.create_publisher(Twist, '/cmd_vel', 10)
        self.twist = Twist()
        self.twist.linear.x = 0.5
        self.twist.angular.z = 0.1
        self.timer = self.create_timer(0.05, self.timer_callback)

    def timer_callback(self):
        msg = Twist()
        self.publisher.publish(msg)
        self.get_logger().info('published a velocity')


def main(args=None):
    rclpy.init(args=args)
    node = VelocityPublisher()
    rclpy.spin(node)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
