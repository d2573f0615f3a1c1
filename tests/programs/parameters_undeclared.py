"""Undeclares a parameter, and asks whether it is there and what to take instead."""
import rclpy
from rclpy.exceptions import ParameterAlreadyDeclaredException, ParameterNotDeclaredException
from rclpy.parameter import Parameter

rclpy.init()
node = rclpy.create_node("changing")
log = node.get_logger()
node.declare_parameter("gain", 1.5)
log.info(f"{node.has_parameter('gain')} {node.has_parameter('other')}")
try:
    node.declare_parameter("gain", 2.5)
except ParameterAlreadyDeclaredException as error:
    log.warning(str(error))
node.undeclare_parameter("gain")
try:
    node.get_parameter("gain")
except ParameterNotDeclaredException as error:
    log.error(str(error))
log.info(str(node.get_parameter_or("gain", alternative_value=Parameter("gain", value=9.0)).value))
node.destroy_node()
rclpy.shutdown(uninstall_handlers=True)
print("done")
