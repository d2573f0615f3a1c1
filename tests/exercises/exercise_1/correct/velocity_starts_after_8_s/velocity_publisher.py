import time
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Mover(Node):
    def __init__(self):
        super().__init__('mover')
        self.publisher_ = self.create_publisher(Twist, 'cmd_vel', 10)
        for i in range(8, 0, -1):
            self.get_logger().warn(f'Robot moves in {i} s, stand back')
            time.sleep(1)
        self.timer = self.create_timer(0.05, self.timer_callback)

    def timer_callback(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.publisher_.publish(msg)


def main(args=None):
    rclpy.init(args=args)
    mover = Mover()
    rclpy.spin(mover)


main()
