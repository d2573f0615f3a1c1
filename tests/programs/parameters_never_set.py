"""Asks for a statically typed parameter that nobody has set."""
import rclpy
from rclpy.exceptions import ParameterUninitializedException
from rclpy.parameter import Parameter

rclpy.init()
node = rclpy.create_node("unset")
node.declare_parameter("port", Parameter.Type.INTEGER)
try:
    print(node.get_parameter("port").value)
except ParameterUninitializedException as error:
    print(error)
print(node.get_parameter_or("port", Parameter("port", value=80)).value)
node.set_parameters([Parameter("port", value="eighty")])
print(node.get_parameter("port").value)
