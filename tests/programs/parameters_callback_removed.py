"""Listens to one change of a parameter, and then no longer."""
import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter


class Once(Node):
    def __init__(self):
        super().__init__("once")
        self.declare_parameter("mode", "slow")
        self.add_on_set_parameters_callback(self.changed)
        self.create_timer(0.6, self.toggle)

    def changed(self, parameters):
        self.get_logger().info(f"mode becomes {parameters[0].value}")
        self.remove_on_set_parameters_callback(self.changed)
        return SetParametersResult(successful=True)

    def toggle(self):
        now = self.get_parameter("mode").value
        self.set_parameters([Parameter("mode", Parameter.Type.STRING, "fast" if now == "slow" else "slow")])
        self.get_logger().info(self.get_parameter("mode").get_parameter_value().string_value)


rclpy.init()
node = Once()
try:
    rclpy.spin(node)
finally:
    node.destroy_node()
