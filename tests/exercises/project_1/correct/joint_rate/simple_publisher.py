"""The angle comes from a generator, the pace from a Rate in a second thread."""
import itertools
import math
import threading

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


def angles():
    for k in itertools.count():
        yield k, math.sin(0.1 * k)


def main():
    rclpy.init()
    node = Node("joint_rate")
    out = node.create_publisher(Float64, "/joint_commands", 5)
    spinner = threading.Thread(target=rclpy.spin, args=(node,), daemon=True)
    spinner.start()
    rate = node.create_rate(10)
    for k, angle in angles():
        if not rclpy.ok():
            break
        out.publish(Float64(data=angle))
        if k % 10 == 9:
            node.get_logger().warn(f"joint at {math.degrees(angle):.1f} degrees")
        rate.sleep()


if __name__ == "__main__":
    main()
