"""Finds out what is a message and what is a service."""
import rclpy
from rclpy.exceptions import NoTypeSupportImportedException
from rclpy.type_support import check_for_type_support, check_is_valid_msg_type, check_is_valid_srv_type
from std_msgs.msg import String
from std_srvs.srv import Trigger

for check, kind in ((check_is_valid_msg_type, String), (check_is_valid_srv_type, Trigger), (check_is_valid_srv_type, String)):
    try:
        check(kind)
        print(check.__name__, kind.__name__, "fits")
    except RuntimeError as error:
        print(check.__name__, kind.__name__, str(error).splitlines()[0][:40])
check_for_type_support(String)
try:
    check_for_type_support(int)
except (AttributeError, NoTypeSupportImportedException) as error:
    print(type(error).__name__)
rclpy.init()
node = rclpy.create_node("types")
node.create_publisher(dict, "topic", 10)
