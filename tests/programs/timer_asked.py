"""Asks its timer when it will fire, and changes its period."""
import rclpy
from rclpy.node import Node


class Asks(Node):
    def __init__(self):
        super().__init__("asks_timer")
        self.slow = self.create_timer(1.0, self.ring)
        self.create_timer(0.4, self.look)

    def ring(self):
        self.get_logger().info(f"rings, {round(self.slow.time_since_last_call() / 1e8)} since the last")
        self.slow.timer_period_ns = 500_000_000

    def look(self):
        left = self.slow.time_until_next_call()
        self.get_logger().info(f"{round(left / 1e8)} left, period {self.slow.timer_period_ns / 1e9}, {self.slow.is_ready()}")


rclpy.init()
rclpy.spin(Asks())
