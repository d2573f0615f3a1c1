"""Changes the levels of its loggers."""
import rclpy
from rclpy.logging import LoggingSeverity, get_logger, get_logger_effective_level, get_logger_level
from rclpy.logging import get_logging_severity_from_string, set_logger_level

rclpy.init()
node = rclpy.create_node("levels")
log = node.get_logger()
part = log.get_child("part")
print(get_logger_effective_level("levels").name, get_logger_level("levels").name, flush=True)
set_logger_level("levels", get_logging_severity_from_string("debug"), detailed_error=True)
part.debug("shown")
part.set_level(LoggingSeverity.ERROR)
part.warning("not shown")
log.debug("shown as well")
print(part.get_effective_level().name, log.is_enabled_for(LoggingSeverity.DEBUG), flush=True)
get_logger("elsewhere").fatal("shown without a node")
