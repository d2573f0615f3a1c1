"""Transforms every kind of stamped geometry message, by the buffer and by hand."""

import math

import rclpy
import tf2_geometry_msgs
from geometry_msgs.msg import (
    PointStamped,
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    TransformStamped,
    Vector3Stamped,
    WrenchStamped,
)
from tf2_ros import Buffer

rclpy.init()
node = rclpy.create_node("transforms")
log = node.get_logger().info
buffer = Buffer()

t = TransformStamped()
t.header.frame_id, t.child_frame_id = "base", "hand"
t.transform.translation.x, t.transform.translation.z = 1.0, 2.0
t.transform.rotation.z = t.transform.rotation.w = math.sqrt(0.5)
buffer.set_transform_static(t, "me")


def of(message):
    message.header.frame_id = "hand"
    return message


def shown(*values):
    return " ".join(f"{value + 0.0:.2f}".replace("-0.00", "0.00") for value in values)


point = of(PointStamped())
point.point.x = 1.0
moved = buffer.transform(point, "base")
log(f"point {shown(moved.point.x, moved.point.y, moved.point.z)} in {moved.header.frame_id}")

vector = of(Vector3Stamped())
vector.vector.x = 1.0
turned = buffer.transform(vector, "base").vector
log(f"vector {shown(turned.x, turned.y, turned.z)}")

pose = of(PoseStamped())
pose.pose.orientation.w = 1.0
there = buffer.transform(pose, "base").pose
log(f"pose {shown(there.position.x, there.position.y, there.orientation.z, there.orientation.w)}")

plain = tf2_geometry_msgs.do_transform_pose(Pose(), buffer.lookup_transform("base", "hand", rclpy.time.Time()))
log(f"origin {shown(plain.position.x, plain.position.y, plain.position.z)}")

spread = of(PoseWithCovarianceStamped())
spread.pose.pose.orientation.w = 1.0
spread.pose.covariance[0], spread.pose.covariance[7] = 4.0, 1.0
found = buffer.transform(spread, "base").pose.covariance
log(f"covariance {shown(found[0], found[7], found[1])}")

wrench = of(WrenchStamped())
wrench.wrench.force.x = 1.0
force = buffer.transform(wrench, "base").wrench.force
log(f"force {shown(force.x, force.y, force.z)}")
rclpy.shutdown()

# logs: point 1.00 1.00 2.00 in base
# logs: vector 0.00 1.00 0.00
# logs: pose 1.00 0.00 0.71 0.71
# logs: origin 1.00 0.00 2.00
# logs: covariance 1.00 4.00 0.00
# logs: force 0.00 1.00 0.00
