"""Offers the services for its logger's level, and sets it through them."""
import rclpy
from rcl_interfaces.msg import LoggerLevel
from rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels
from rclpy.executors import SingleThreadedExecutor

rclpy.init()
node = rclpy.create_node("quiet", enable_logger_service=True)
asker = rclpy.create_node("asker")
executor = SingleThreadedExecutor()
executor.add_node(node)
executor.add_node(asker)
levels = asker.create_client(GetLoggerLevels, "/quiet/get_logger_levels")
change = asker.create_client(SetLoggerLevels, "/quiet/set_logger_levels")
print(levels.wait_for_service(3.0), change.wait_for_service(3.0), flush=True)
future = change.call_async(SetLoggerLevels.Request(levels=[LoggerLevel(name="quiet", level=40)]))
executor.spin_until_future_complete(future)
print([result.successful for result in future.result().results], flush=True)
node.get_logger().info("not shown")
node.get_logger().error("shown")
future = levels.call_async(GetLoggerLevels.Request(names=["quiet"]))
executor.spin_until_future_complete(future)
print(future.result().levels[0].level, flush=True)
