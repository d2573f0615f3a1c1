"""Works for 15 ms and sleeps for 50 ms: 15 Hz, however often it looks at a clock."""

import time

import rclpy
from geometry_msgs.msg import Twist


def work():
    begin = time.process_time()
    while time.process_time() - begin < 0.015:
        sum(range(500))


def main():
    rclpy.init()
    node = rclpy.create_node("velocity_publisher")
    publisher = node.create_publisher(Twist, "cmd_vel", 10)
    message = Twist()
    message.linear.x, message.angular.z = 0.5, 0.1
    while rclpy.ok():
        publisher.publish(message)
        node.get_logger().info("driving")
        work()
        time.time()
        time.sleep(0.05)


if __name__ == "__main__":
    main()
