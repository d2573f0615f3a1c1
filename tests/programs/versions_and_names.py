"""What a program may ask about the installation."""
import rclpy
from rclpy.utilities import get_rmw_implementation_identifier, timeout_sec_to_nsec

rclpy.init()
node = rclpy.create_node("asks", use_global_arguments=False)
print(get_rmw_implementation_identifier())
for seconds in (None, 0, 1.5, -2):
    print(seconds, timeout_sec_to_nsec(seconds))
print(node.default_callback_group.__class__.__name__, node.PARAM_REL_TOL)
try:
    timeout_sec_to_nsec("two")
except TypeError as error:
    print(type(error).__name__)
print(rclpy.utilities.remove_ros_args(["program", "--ros-args", "-r", "a:=b", "--", "file"]))
