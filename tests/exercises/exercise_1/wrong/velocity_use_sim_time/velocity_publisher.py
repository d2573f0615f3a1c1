import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node
from rclpy.parameter import Parameter


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher', parameter_overrides=[Parameter('use_sim_time', Parameter.Type.BOOL, True)])
        self.publisher = self.create_publisher(Twist, '/cmd_vel', 10)
        self.timer = self.create_timer(0.05, self.drive)
        self.get_logger().info('velocity publisher is running')

    def drive(self):
        command = Twist()
        command.linear.x = 0.5
        command.angular.z = 0.1
        self.publisher.publish(command)


def main():
    rclpy.init()
    node = VelocityPublisher()
    rclpy.spin(node)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
