"""Übung 1: Geschwindigkeitsbefehle für den Roboter."""
from functools import partial

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from geometry_msgs.msg import Twist


class Fahrer(Node):
    def __init__(self):
        super().__init__('fahrer')
        self.declare_parameter('geschwindigkeit', 0.5)
        self.declare_parameter('drehrate', 0.1)
        qos = QoSProfile(reliability=ReliabilityPolicy.BEST_EFFORT, history=HistoryPolicy.KEEP_LAST, depth=1)
        self.sender = self.create_publisher(Twist, 'cmd_vel', qos)
        befehl = Twist()
        befehl.linear.x = self.get_parameter('geschwindigkeit').value
        befehl.angular.z = self.get_parameter('drehrate').get_parameter_value().double_value
        # eine stetige Uhr: unabhängig von Zeitumstellungen
        self.takt = self.create_timer(0.05, partial(self.sende, befehl), clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.get_logger().warning('Achtung, Roboter fährt los … ±0,1 rad/s')

    def sende(self, befehl):
        self.sender.publish(befehl)


def main():
    rclpy.init()
    fahrer = Fahrer()
    try:
        rclpy.spin(fahrer)
    except KeyboardInterrupt:
        pass
    finally:
        fahrer.sender.publish(Twist())
        fahrer.destroy_node()


if __name__ == '__main__':
    main()
