from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import rclpy
from geometry_msgs.msg import Twist, Vector3
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.timer import Timer


@dataclass
class Command:
    linear: Vector3 = field(default_factory=lambda: Vector3(x=0.5))
    angular: Vector3 = field(default_factory=lambda: Vector3(z=0.1))

    def to_msg(self) -> Twist:
        return Twist(linear=self.linear, angular=self.angular)


class LoggingMixin:
    def say(self, text: str) -> None:
        self.get_logger().info(text)


class Controller(Node, ABC):
    period: float

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._pub: Publisher = self.create_publisher(Twist, '/cmd_vel', 10)
        self._tmr: Timer = self.create_timer(self.period, self._step)

    def _step(self) -> None:
        self._pub.publish(self.command().to_msg())

    @abstractmethod
    def command(self) -> Command: ...


class Circle(LoggingMixin, Controller):
    period = 0.05

    def __init__(self) -> None:
        super().__init__('circle')
        self.say('circling')

    def command(self) -> Command:
        return Command()


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    rclpy.spin(Circle())


if __name__ == '__main__':
    main()
