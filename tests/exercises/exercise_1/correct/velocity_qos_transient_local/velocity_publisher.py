import copy
import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data, QoSDurabilityPolicy, QoSReliabilityPolicy
from geometry_msgs.msg import Twist


class Latched(Node):
    def __init__(self):
        super().__init__('latched')
        qos = copy.copy(qos_profile_sensor_data)
        qos.durability = QoSDurabilityPolicy.TRANSIENT_LOCAL
        qos.reliability = QoSReliabilityPolicy.RELIABLE
        qos.depth = 1
        self.pub = self.create_publisher(Twist, '/cmd_vel', qos)
        self.timer = self.create_timer(0.05, self.cb)

    def cb(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.pub.publish(msg)
        self.get_logger().info('cmd', throttle_duration_sec=5.0)


def main():
    rclpy.init()
    rclpy.spin(Latched())


if __name__ == '__main__':
    main()
