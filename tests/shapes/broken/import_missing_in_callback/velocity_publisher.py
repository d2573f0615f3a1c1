import rclpy
from rclpy.node import Node
import geometry_msgs.msg


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.publisher_ = self.create_publisher(geometry_msgs.msg.Twist, '/cmd_vel', 10)
        self.timer = self.create_timer(0.05, self.timer_callback)
        self.get_logger().info('started')

    def timer_callback(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.publisher_.publish(msg)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
