import math
import threading
import time

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


def publish(node, publisher, stop):
    """Publish from a thread of its own, against deadlines so that no delay adds up."""
    start = time.monotonic()
    number = 0
    while not stop.is_set():
        angle = math.sin(0.1 * number)
        publisher.publish(Float64(data=angle))
        number += 1
        if number % 10 == 0:
            node.get_logger().info(f"{number} commands so far, joint now at {math.degrees(angle):+.1f} deg")
        stop.wait(max(0.0, start + 0.1 * number - time.monotonic()))


def main():
    rclpy.init()
    node = Node("joint")
    publisher = node.create_publisher(Float64, "joint_commands", 10)
    stop = threading.Event()
    worker = threading.Thread(target=publish, args=(node, publisher, stop), daemon=True)
    worker.start()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        stop.set()


if __name__ == "__main__":
    main()
