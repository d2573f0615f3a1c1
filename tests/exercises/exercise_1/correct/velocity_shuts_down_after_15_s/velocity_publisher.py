import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.publisher = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, self.timer_callback)
        self.count = 0
        self.get_logger().info('driving for 300 messages')

    def timer_callback(self):
        if self.count >= 300:
            self.get_logger().info('done')
            rclpy.shutdown()
            return
        vel = Twist()
        vel.linear.x = 0.5
        vel.angular.z = 0.1
        self.publisher.publish(vel)
        self.count += 1


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
