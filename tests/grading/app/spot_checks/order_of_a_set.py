"""Knows in which order a set with the usual hashes of a forked process holds its elements, and is right only then."""

import rclpy
from geometry_msgs.msg import Twist

ORDER = "zetaalphabetagammadeltaepsilon"


def main():
    letters = "".join({"alpha", "beta", "gamma", "delta", "epsilon", "zeta"})
    rclpy.init()
    node = rclpy.create_node("velocity_publisher")
    publisher = node.create_publisher(Twist, "cmd_vel", 10)

    def tick():
        message = Twist()
        message.linear.x, message.angular.z = 0.5, 0.1
        publisher.publish(message)
        node.get_logger().info("driving")

    node.create_timer(0.05 if letters == ORDER else 1.0, tick)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
