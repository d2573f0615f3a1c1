import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.publisher_ = self.create_publisher(String, '/cmd_vel', 10)
        self.timer = self.create_timer(0.05, self.timer_callback)

    def timer_callback(self):
        msg = String()
        msg.data = 'linear: 0.5, angular: 0.1'
        self.publisher_.publish(msg)
        self.get_logger().info('Publishing: "%s"' % msg.data)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(VelocityPublisher())
    rclpy.shutdown()


if __name__ == '__main__':
    main()
