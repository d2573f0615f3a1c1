import math
from dataclasses import asdict, dataclass, replace
from enum import Enum, auto

import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class State(Enum):
    STARTING = auto()
    DRIVING = auto()


@dataclass(frozen=True)
class Settings:
    speed_cm_s: int = 50
    turn_deg_s: float = 5.729577951308232
    hertz: int = 20
    topic: str = '/cmd_vel'

    @property
    def period(self):
        return 1.0 / self.hertz


class VelocityPublisher(Node):
    def __init__(self, settings: Settings = Settings()):
        super().__init__('velocity_publisher')
        self.settings = replace(settings)
        self.state = State.STARTING
        self.pub = self.create_publisher(Twist, self.settings.topic, 10)
        self.timer = self.create_timer(self.settings.period, self.on_timer)

    def on_timer(self):
        handler = {State.STARTING: self.start, State.DRIVING: self.drive}[self.state]
        handler()

    def start(self):
        self.get_logger().info(f'settings: {asdict(self.settings)}')
        self.state = State.DRIVING
        self.drive()

    def drive(self):
        twist = Twist()
        twist.linear.x = self.settings.speed_cm_s / 100
        twist.angular.z = math.radians(self.settings.turn_deg_s)
        self.pub.publish(twist)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
