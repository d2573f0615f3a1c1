"""OpenCV has blue first, ROS names it: the same image in three encodings."""

import numpy as np
import rclpy
from cv_bridge import CvBridge

rclpy.init()
node = rclpy.create_node("colours")
bridge = CvBridge()
image = np.zeros((2, 2, 3), dtype=np.uint8)
image[:, :] = (255, 100, 0)  # blue, green, red
msg = bridge.cv2_to_imgmsg(image, "bgr8")
for encoding in ("bgr8", "rgb8", "mono8", "rgba8", "passthrough"):
    found = bridge.imgmsg_to_cv2(msg, encoding)
    node.get_logger().info(f"{encoding}: {found.shape} {np.atleast_1d(found[0, 0]).tolist()}")
rclpy.shutdown()

# logs: bgr8: (2, 2, 3) [255, 100, 0]
# logs: rgb8: (2, 2, 3) [0, 100, 255]
# logs: mono8: (2, 2) [88]
# logs: rgba8: (2, 2, 4) [0, 100, 255, 255]
# logs: passthrough: (2, 2, 3) [255, 100, 0]
