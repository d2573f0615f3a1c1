import threading
import time
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Driver(Node):
    def __init__(self):
        super().__init__('driver')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        while rclpy.ok():
            self.pub.publish(msg)
            self.get_logger().info('cmd_vel sent')
            time.sleep(0.05)


def main():
    rclpy.init()
    node = Driver()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
