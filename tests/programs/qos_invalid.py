"""A profile without the depth that its history needs."""
import rclpy
from rclpy.qos import HistoryPolicy, InvalidQoSProfileException, QoSProfile

rclpy.init()
node = rclpy.create_node("invalid")
for arguments in ({"history": HistoryPolicy.KEEP_LAST}, {}):
    try:
        QoSProfile(**arguments)
    except InvalidQoSProfileException as error:
        node.get_logger().warning(str(error).splitlines()[0])
whole = QoSProfile(history=HistoryPolicy.KEEP_ALL)
print(whole.depth, whole.avoid_ros_namespace_conventions, whole.lifespan.nanoseconds > 0)
