"""Turns parameters into messages and back."""
import rclpy
from rclpy.exceptions import InvalidParameterValueException
from rclpy.parameter import Parameter, parameter_value_to_python

rclpy.init()
node = rclpy.create_node("convert", parameter_overrides=[Parameter("count", value=7)])
node.declare_parameter("count", 1)
node.declare_parameter("kept", 2, ignore_override=True)
for name, value in (("flag", True), ("text", "x"), ("list", [1.0, 2.0]), ("bytes", [b"a"])):
    message = Parameter(name, value=value).to_parameter_msg()
    again = Parameter.from_parameter_msg(message)
    node.get_logger().info(f"{again.name} {again.type_.name} {parameter_value_to_python(message.value)}")
node.get_logger().info(f"{node.get_parameter('count').value} {node.get_parameter('kept').value}")
try:
    node.declare_parameter("mixed", [1, "two"])
except (TypeError, ValueError, InvalidParameterValueException) as error:
    node.get_logger().info(type(error).__name__)
