import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.declare_parameter('linear_speed', 0.5)
        self.declare_parameter('angular_speed', 0.1)
        self.declare_parameter('rate', 20.0)
        self.declare_parameter('topic', 'cmd_vel')
        topic = self.get_parameter('topic').get_parameter_value().string_value
        rate = self.get_parameter('rate').get_parameter_value().double_value
        self.pub = self.create_publisher(Twist, topic, 10)
        self.timer = self.create_timer(1.0 / rate, self.publish_velocity)
        self.get_logger().info(f'{topic} at {rate} Hz')

    def publish_velocity(self):
        cmd = Twist()
        cmd.linear.x = self.get_parameter('linear_speed').value
        cmd.angular.z = self.get_parameter('angular_speed').value
        self.pub.publish(cmd)


def main(args=None):
    rclpy.init(args=args)
    node = VelocityPublisher()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
