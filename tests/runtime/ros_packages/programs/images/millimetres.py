"""Another depth camera: whole millimetres in 16 bits, 0 where nothing is known."""

import numpy as np
import rclpy
from cv_bridge import CvBridge
from sensor_msgs.msg import Image

rclpy.init()
node = rclpy.create_node("millimetres")
bridge = CvBridge()
depth = np.array([[0, 1500], [2500, 3000]], dtype=np.uint16)
msg = bridge.cv2_to_imgmsg(depth)
node.get_logger().info(f"{msg.encoding}, {len(msg.data)} bytes")
found = bridge.imgmsg_to_cv2(msg, "16UC1")
metres = found[found > 0].astype(float) / 1000
node.get_logger().info(f"{metres.tolist()} {found.dtype}")
big = Image(height=1, width=1, encoding="16UC1", is_bigendian=1, step=2, data=[1, 2])
node.get_logger().info(f"{bridge.imgmsg_to_cv2(big)[0, 0]} with the first byte large")
padded = Image(height=2, width=1, encoding="mono8", step=4, data=[9, 0, 0, 0, 8, 0, 0, 0])
node.get_logger().info(f"{bridge.imgmsg_to_cv2(padded).ravel().tolist()} with padding")
rclpy.shutdown()

# logs: 16UC1, 8 bytes
# logs: [1.5, 2.5, 3.0] uint16
# logs: 258 with the first byte large
# logs: [9, 8] with padding
