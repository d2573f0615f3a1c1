"""Is told when its context shuts down, and knows its domain."""
import os

import rclpy
from rclpy.context import Context

context = Context()
context.init(args=["--ros-args", "--log-level", "warn"], initialize_logging=True)
context.on_shutdown(lambda: print("context ends", flush=True))
node = rclpy.create_node("own", context=context)
print(context.get_domain_id() == int(os.environ.get("ROS_DOMAIN_ID", 0)), context.ok(), flush=True)
node.get_logger().info("not shown")
node.get_logger().warning("shown")
print(rclpy.utilities.get_default_context() is context, rclpy.ok(), rclpy.ok(context=context), flush=True)
context.try_shutdown()
context.try_shutdown()
print(context.ok(), flush=True)
rclpy.create_node("too_late", context=context)
