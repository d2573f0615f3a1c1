import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Robot(Node):
    def __init__(self):
        super().__init__('velocity_publisher', namespace='robot1')
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.05, self.drive)

    def drive(self):
        t = Twist()
        t.linear.x = 0.5
        t.angular.z = 0.1
        self.pub.publish(t)
        self.get_logger().info('driving', throttle_duration_sec=1.0)


def main():
    rclpy.init()
    rclpy.spin(Robot())


if __name__ == '__main__':
    main()
