import math

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class AngleTable(Node):
    """One row for each angle: its number, the time, the angle in six units, and the eight last ones."""

    def __init__(self):
        super().__init__('simple_subscriber')
        self.rows = []
        self.create_subscription(Float64, '/joint_commands', self.listener_callback, 10)

    def listener_callback(self, msg):
        angle = msg.data
        self.rows.append(round(angle, 2))
        units = [angle / math.tau, angle, math.degrees(angle), angle * 200 / math.pi, 1000 * angle, abs(angle)]
        now = self.get_clock().now().nanoseconds / 1e9
        row = ';'.join(f'{value:.3f}' for value in units)
        self.get_logger().info(f'{len(self.rows)};{now:.3f};{row};{self.rows[-8:]}')


def main():
    rclpy.init()
    rclpy.spin(AngleTable())


if __name__ == '__main__':
    main()
