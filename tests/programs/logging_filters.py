"""Logs once, every other time, and not more than once a second."""
import rclpy

rclpy.init()
node = rclpy.create_node("filters")
count = 0


def tick():
    global count
    count += 1
    node.get_logger().info(f"once {count}", once=True)
    node.get_logger().warning(f"skip the first {count}", skip_first=True)
    node.get_logger().error(f"throttled {count}", throttle_duration_sec=1.0)
    node.get_logger().log(f"both {count}", rclpy.logging.LoggingSeverity.INFO, throttle_duration_sec=0.6, skip_first=True)


node.create_timer(0.4, tick)
rclpy.spin(node)
