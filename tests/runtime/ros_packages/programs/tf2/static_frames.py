"""The tutorial's static broadcaster: places a frame by roll, pitch and yaw, and a listener finds it."""

import math

import numpy as np
import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from tf2_ros import TransformException
from tf2_ros.buffer import Buffer
from tf2_ros.static_transform_broadcaster import StaticTransformBroadcaster
from tf2_ros.transform_listener import TransformListener


def quaternion_from_euler(ai, aj, ak):
    ai, aj, ak = ai / 2, aj / 2, ak / 2
    ci, si, cj, sj, ck, sk = math.cos(ai), math.sin(ai), math.cos(aj), math.sin(aj), math.cos(ak), math.sin(ak)
    q = np.empty((4,))
    q[0] = cj * si * ck - sj * ci * sk
    q[1] = cj * si * sk + sj * ci * ck
    q[2] = cj * ci * sk - sj * si * ck
    q[3] = cj * ci * ck + sj * si * sk
    return q


class StaticFramePublisher(Node):
    def __init__(self):
        super().__init__("static_turtle_tf2_broadcaster")
        self.tf_static_broadcaster = StaticTransformBroadcaster(self)
        self.buffer = Buffer()
        self.listener = TransformListener(self.buffer, self)
        self.make_transforms(["mystaticturtle", "1", "2", "3", "0", "0", "1.57"])
        self.create_timer(0.1, self.look)

    def make_transforms(self, transformation):
        t = TransformStamped()
        t.header.stamp = self.get_clock().now().to_msg()
        t.header.frame_id = "world"
        t.child_frame_id = transformation[0]
        t.transform.translation.x = float(transformation[1])
        t.transform.translation.y = float(transformation[2])
        t.transform.translation.z = float(transformation[3])
        quat = quaternion_from_euler(float(transformation[4]), float(transformation[5]), float(transformation[6]))
        t.transform.rotation.x = quat[0]
        t.transform.rotation.y = quat[1]
        t.transform.rotation.z = quat[2]
        t.transform.rotation.w = quat[3]
        self.tf_static_broadcaster.sendTransform(t)

    def look(self):
        try:
            t = self.buffer.lookup_transform("world", "mystaticturtle", rclpy.time.Time())
        except TransformException:
            return
        shift, turn = t.transform.translation, t.transform.rotation
        self.get_logger().info(f"{shift.x} {shift.y} {shift.z} turned by {2 * math.atan2(turn.z, turn.w):.2f}")
        raise SystemExit


def main():
    rclpy.init()
    node = StaticFramePublisher()
    rclpy.spin(node)


if __name__ == "__main__":
    main()

# logs: 1.0 2.0 3.0 turned by 1.57
