"""What the bridge refuses, and with which exception."""

import numpy as np
import rclpy
from cv_bridge import CvBridge, CvBridgeError
from sensor_msgs.msg import Image

rclpy.init()
node = rclpy.create_node("wrong")
bridge = CvBridge()
grey = np.zeros((2, 2), np.uint8)
depth = bridge.cv2_to_imgmsg(np.zeros((2, 2), np.float32))


def tried(what, work):
    try:
        work()
        node.get_logger().info(f"{what}: fine")
    except CvBridgeError:
        node.get_logger().info(f"{what}: CvBridgeError")
    except TypeError:
        node.get_logger().info(f"{what}: TypeError")


tried("grey as bgr8", lambda: bridge.cv2_to_imgmsg(grey, "bgr8"))
tried("a list", lambda: bridge.cv2_to_imgmsg([[1, 2]]))
tried("depth as colours", lambda: bridge.imgmsg_to_cv2(depth, "bgr8"))
tried("an unknown encoding", lambda: bridge.imgmsg_to_cv2(Image(encoding="pink")))
tried("grey as it is", lambda: bridge.cv2_to_imgmsg(grey, "mono8"))
tried("depth as it is", lambda: bridge.imgmsg_to_cv2(depth, "32FC1"))
rclpy.shutdown()

# logs: grey as bgr8: CvBridgeError
# logs: a list: TypeError
# logs: depth as colours: CvBridgeError
# logs: an unknown encoding: CvBridgeError
# logs: grey as it is: fine
# logs: depth as it is: fine
