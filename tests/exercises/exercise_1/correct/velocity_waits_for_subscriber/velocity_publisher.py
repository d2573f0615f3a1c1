import time
import rclpy
from rclpy.node import Node
from rclpy.executors import SingleThreadedExecutor
from geometry_msgs.msg import Twist

PERIOD = 0.05


class VelocityCommander(Node):
    def __init__(self):
        super().__init__('velocity_commander', namespace='/')
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        while self.pub.get_subscription_count() == 0:
            self.get_logger().info('waiting for the base to listen...')
            time.sleep(0.5)
        time.sleep(2)
        self.create_timer(PERIOD, self.step)

    def step(self):
        cmd = Twist()
        cmd.linear.x = 0.5
        cmd.angular.z = 0.1
        self.pub.publish(cmd)


def main():
    rclpy.init()
    ex = SingleThreadedExecutor()
    ex.add_node(VelocityCommander())
    try:
        ex.spin()
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        ex.shutdown()


if __name__ == '__main__':
    main()
