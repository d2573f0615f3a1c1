"""Sensors publish best effort, so the filter's subscription has to ask for no more."""

import rclpy
from message_filters import Subscriber, TimeSynchronizer
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu, LaserScan


class Sensors(Node):
    def __init__(self):
        super().__init__("sensors")
        scan = Subscriber(self, LaserScan, "/scan", qos_profile=qos_profile_sensor_data)
        imu = Subscriber(self, Imu, "/imu", qos_profile=qos_profile_sensor_data)
        self.sync = TimeSynchronizer([scan, imu], 10)
        self.sync.registerCallback(self.both)
        self.scan = self.create_publisher(LaserScan, "/scan", qos_profile_sensor_data)
        self.imu = self.create_publisher(Imu, "/imu", qos_profile_sensor_data)
        self.create_timer(0.1, self.send)

    def send(self):
        scan, imu = LaserScan(ranges=[1.0, 2.0]), Imu()
        scan.header.stamp = imu.header.stamp = self.get_clock().now().to_msg()
        imu.linear_acceleration.z = 9.81
        self.scan.publish(scan)
        self.imu.publish(imu)

    def both(self, scan, imu):
        self.get_logger().info(f"{min(scan.ranges)} m, {imu.linear_acceleration.z} m/s2")
        raise SystemExit


rclpy.init()
rclpy.spin(Sensors())

# logs: 1.0 m, 9.81 m/s2
