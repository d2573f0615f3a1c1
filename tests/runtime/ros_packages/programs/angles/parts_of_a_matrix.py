"""Takes a calibration matrix apart, and puts it together again."""

import math

import numpy as np
import rclpy
import tf_transformations as tft

rclpy.init()
log = rclpy.create_node("calibration").get_logger().info
whole = tft.compose_matrix(scale=(1.0, 2.0, 3.0), angles=(0.0, 0.0, math.pi / 6), translate=(4.0, 5.0, 6.0))
scale, shear, angles, translate, perspective = tft.decompose_matrix(whole)
log("scale " + " ".join(f"{v:.1f}" for v in scale))
log("angles " + " ".join(f"{math.degrees(v) + 0.0:.1f}".replace("-0.0", "0.0") for v in angles))
log("translation " + " ".join(f"{v:.1f}" for v in translate))
again = tft.compose_matrix(scale, shear, angles, translate, perspective)
log(f"the same: {tft.is_same_transform(whole, again)}")
angle, direction, point = tft.rotation_from_matrix(tft.rotation_matrix(0.7, (0, 0, 1), (1, 0, 0)))
log(f"turned by {angle * direction[2]:.1f} about a line {np.allclose(point[1], 0.0)}")
rclpy.shutdown()

# logs: scale 1.0 2.0 3.0
# logs: angles 0.0 0.0 30.0
# logs: translation 4.0 5.0 6.0
# logs: the same: True
# logs: turned by 0.7 about a line True
