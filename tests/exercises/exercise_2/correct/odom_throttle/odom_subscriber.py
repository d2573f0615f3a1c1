import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from nav_msgs.msg import Odometry


class Odom(Node):
    def __init__(self):
        super().__init__("odom")
        self.create_subscription(Odometry, "odom", self.callback, qos_profile_sensor_data)

    def callback(self, msg):
        x = msg.pose.pose.position.x
        y = msg.pose.pose.position.y
        self.get_logger().info("robot is at (%.3f, %.3f)" % (x, y), throttle_duration_sec=1.0)


def main():
    rclpy.init()
    rclpy.spin(Odom())


main()
