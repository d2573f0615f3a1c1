import math
import queue
import threading

import rclpy
from std_msgs.msg import Float64


def write(log, angles):
    """Log from a thread of its own; what the callback puts in comes out in order."""
    while (angle := angles.get()) is not None:
        log.info(f"Winkel: {angle:+.4f} (Bogenmass), {180 * angle / math.pi:+07.2f} (Grad)")


def main():
    rclpy.init()
    node = rclpy.create_node("angles")
    angles = queue.Queue()
    threading.Thread(target=write, args=(node.get_logger(), angles), daemon=True).start()
    node.create_subscription(Float64, "/joint_commands", lambda msg: angles.put(msg.data), 10)
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        angles.put(None)


if __name__ == "__main__":
    main()
