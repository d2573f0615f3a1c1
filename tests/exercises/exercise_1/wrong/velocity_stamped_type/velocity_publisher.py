import rclpy
from rclpy.node import Node
from geometry_msgs.msg import TwistStamped


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(TwistStamped, '/cmd_vel', 10)
        self.create_timer(0.05, self.publish_velocity)

    def publish_velocity(self):
        msg = TwistStamped()
        msg.header.stamp = self.get_clock().now().to_msg()
        msg.header.frame_id = 'base_link'
        msg.twist.linear.x = 0.5
        msg.twist.angular.z = 0.1
        self.pub.publish(msg)
        self.get_logger().info('published')


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
