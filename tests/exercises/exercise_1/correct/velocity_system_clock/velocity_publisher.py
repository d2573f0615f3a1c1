import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.log = self.get_logger().get_child('loop')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.wall = Clock(clock_type=ClockType.SYSTEM_TIME)
        self.create_timer(0.05, self.tick, clock=self.wall)

    def tick(self):
        cmd = Twist()
        cmd.linear.x, cmd.linear.y, cmd.linear.z = 0.5, 0.0, 0.0
        cmd.angular.x, cmd.angular.y, cmd.angular.z = 0.0, 0.0, 0.1
        self.pub.publish(cmd)
        self.log.info('tick')


def main():
    rclpy.init()
    try:
        rclpy.spin(VelocityPublisher())
    finally:
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
