import math, rclpy
from rclpy.node import Node
from std_msgs.msg import Float64
from rclpy.qos import qos_profile_sensor_data

class J(Node):
    def __init__(self):
        Node.__init__(self, 'j')
        self.n = 0
        self.p = self.create_publisher(Float64, 'joint_commands', qos_profile_sensor_data)
        self.t = self.create_timer(0.1, lambda: self.go())
    def go(self):
        a = math.sin(self.n * .1)
        self.p.publish(Float64(data=a))
        self.get_logger().debug(f'n={self.n} a={a}')
        self.n = self.n + 1
        if not self.n % 10:
            self.get_logger().info(f'nach {self.n} Nachrichten: Winkel {a:+.5f}')

rclpy.init()
rclpy.spin(J())
