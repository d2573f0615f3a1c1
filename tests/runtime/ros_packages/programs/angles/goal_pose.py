"""Sends goals with a heading, as for navigation: the quaternion of a yaw has only z and w."""

import rclpy
import tf_transformations
from geometry_msgs.msg import PoseStamped, Quaternion

rclpy.init()
node = rclpy.create_node("goals")
for yaw in (0.0, 1.57, -1.57, 3.14):
    goal = PoseStamped()
    goal.header.frame_id = "map"
    goal.header.stamp = node.get_clock().now().to_msg()
    q_x, q_y, q_z, q_w = tf_transformations.quaternion_from_euler(0.0, 0.0, yaw)
    goal.pose.orientation = Quaternion(x=q_x, y=q_y, z=q_z, w=q_w)
    o = goal.pose.orientation
    node.get_logger().info(f"{o.x:.3f} {o.y:.3f} {o.z:.3f} {o.w:.3f}")
rclpy.shutdown()

# logs: 0.000 0.000 0.000 1.000
# logs: 0.000 0.000 0.707 0.707
# logs: 0.000 0.000 -0.707 0.707
# logs: 0.000 0.000 1.000 0.001
