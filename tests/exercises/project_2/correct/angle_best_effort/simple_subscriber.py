from math import degrees
import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Float64

class A(Node):
    def __init__(self):
        super().__init__('a')
        self.count = 0
        self.create_subscription(Float64, 'joint_commands', self.cb, qos_profile_sensor_data)
    def cb(self, m):
        self.count += 1
        self.get_logger().warning('#%d: %+.4f rad / %+.2f Grad' % (self.count, m.data, degrees(m.data)))

rclpy.init()
rclpy.spin(A())
