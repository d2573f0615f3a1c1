"""Sets two parameters together: both or none."""
import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter


class Both(Node):
    def __init__(self):
        super().__init__("both")
        self.declare_parameter("low", 1)
        self.declare_parameter("high", 5)
        self.add_on_set_parameters_callback(self.check)
        self.tries = [(2, 6), (9, 3), (3, 4)]
        self.create_timer(0.4, self.attempt)

    def check(self, parameters):
        values = {p.name: p.value for p in parameters}
        return SetParametersResult(successful=values["low"] < values["high"], reason="low must be below high")

    def attempt(self):
        if not self.tries:
            raise SystemExit(3)
        low, high = self.tries.pop(0)
        result = self.set_parameters_atomically([Parameter("low", value=low), Parameter("high", value=high)])
        now = [self.get_parameter(name).value for name in ("low", "high")]
        self.get_logger().info(f"{result.successful} {result.reason!r} {now}")


rclpy.init()
rclpy.spin(Both())
