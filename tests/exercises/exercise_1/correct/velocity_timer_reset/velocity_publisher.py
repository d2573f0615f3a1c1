import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.main_timer = self.create_timer(10.0, self.send)
        self.main_timer.cancel()
        self.main_timer.timer_period_ns = Duration(seconds=1 / 20).nanoseconds
        self.once = self.create_timer(0.7, self.go)

    def go(self):
        self.once.cancel()
        self.get_logger().info('Motor enabled')
        self.main_timer.reset()

    def send(self):
        twist = Twist()
        twist.linear.x = 0.5
        twist.angular.z = 0.1
        self.pub.publish(twist)


def main(args=None):
    rclpy.init(args=args)
    node = VelocityPublisher()
    rclpy.spin(node)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
