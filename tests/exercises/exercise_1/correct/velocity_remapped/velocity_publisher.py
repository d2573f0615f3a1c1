import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher', cli_args=['--ros-args', '-r', 'velocity:=/cmd_vel'])
        self.pub = self.create_publisher(Twist, 'velocity', 10)
        self.create_timer(0.05, self.on_timer)
        self.get_logger().info('publishing on ' + self.pub.topic_name)

    def on_timer(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.pub.publish(msg)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
