"""Names that students need and misspell: import locations, and attributes of Node and of messages."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from grader.grading.judging.source import words

#: Message and service packages that are installed where submissions run.
PACKAGES = words(
    "std_msgs geometry_msgs nav_msgs sensor_msgs std_srvs builtin_interfaces action_msgs actionlib_msgs "
    "diagnostic_msgs lifecycle_msgs rcl_interfaces rosgraph_msgs service_msgs shape_msgs stereo_msgs "
    "trajectory_msgs unique_identifier_msgs visualization_msgs"
)
#: Names that exist only in ROS 1, with their replacement.
ROS_1 = {
    "rospy": "rclpy",
    "roslib": "rclpy",
    "roscpp": "rclpy",
    "rosgraph": "rclpy",
    "actionlib": "rclpy.action",
    "dynamic_reconfigure": "ROS 2 parameters: declare_parameter",
}
ROS_1_CALLS = {
    "Publisher": "self.create_publisher",
    "Subscriber": "self.create_subscription",
    "Timer": "self.create_timer",
    "Rate": "self.create_timer",
    "init_node": "rclpy.init and a Node",
    "spin": "rclpy.spin",
    "loginfo": "self.get_logger().info",
    "is_shutdown": "rclpy.ok",
    "Service": "self.create_service",
    "get_param": "self.get_parameter",
    "ServiceProxy": "self.create_client",
    "wait_for_service": "client.wait_for_service",
    "logwarn": "self.get_logger().warn",
    "logerr": "self.get_logger().error",
    "logdebug": "self.get_logger().debug",
    "logfatal": "self.get_logger().fatal",
    "sleep": "time.sleep, or a timer",
    "get_name": "self.get_name",
    "set_param": "self.set_parameters",
    "has_param": "self.has_parameter",
    "get_rostime": "self.get_clock().now",
    "signal_shutdown": "rclpy.shutdown",
    "wait_for_message": "rclpy.wait_for_message.wait_for_message",
    "Time": "rclpy.time.Time",
    "Duration": "rclpy.duration.Duration",
}
#: Classes of rclpy that are not in the package itself, with their module.
RCLPY_CLASSES = {
    "Node": "rclpy.node",
    "SingleThreadedExecutor": "rclpy.executors",
    "MultiThreadedExecutor": "rclpy.executors",
    "QoSProfile": "rclpy.qos",
    "ReentrantCallbackGroup": "rclpy.callback_groups",
    "MutuallyExclusiveCallbackGroup": "rclpy.callback_groups",
    "Duration": "rclpy.duration",
    "Time": "rclpy.time",
    "Clock": "rclpy.clock",
    "ActionClient": "rclpy.action",
    "ActionServer": "rclpy.action",
}
#: Read-only properties of Node.
NODE_PROPERTIES = words(
    "publishers subscriptions clients services timers guards waitables executor context handle default_callback_group"
)
#: Methods of Node that students call.
NODE_METHODS = words(
    "create_publisher create_subscription create_timer create_rate create_client create_service "
    "create_guard_condition destroy_node destroy_timer destroy_publisher destroy_subscription get_logger get_clock "
    "get_name get_namespace get_parameter declare_parameter declare_parameters set_parameters "
    "add_on_set_parameters_callback count_publishers count_subscribers get_topic_names_and_types"
)
RCLPY = words(
    "init spin spin_once spin_until_future_complete shutdown try_shutdown ok create_node get_default_context "
    "get_global_executor"
)
#: Modules of rclpy that `import rclpy` does not import.
RCLPY_MODULES = words(
    "action callback_groups clock client duration event_handler executors lifecycle logging node parameter_client "
    "parameter_service publisher qos qos_event qos_overriding_options serialization service subscription time "
    "time_source timer topic_endpoint_info type_support validate_full_topic_name wait_for_message waitable"
)
#: Names that other languages and releases use for methods of Node, with the method that is meant.
NODE_SLIPS = {
    "create_subscriber": "create_subscription",
    "subscribe": "create_subscription",
    "subscription": "create_subscription",
    "create_wall_timer": "create_timer",
    "advertise": "create_publisher",
    "publisher": "create_publisher",
    "create_server": "create_service",
    "create_service_client": "create_client",
    "logger": "get_logger()",
    "get_log": "get_logger",
    "clock": "get_clock()",
    "now": "get_clock().now",
    "get_time": "get_clock().now",
    "declare_param": "declare_parameter",
    "get_param": "get_parameter",
}
#: The positional parameters of the methods of Node that create something, without `self`.
SIGNATURES = {
    "create_publisher": ("msg_type", "topic", "qos_profile"),
    "create_subscription": ("msg_type", "topic", "callback", "qos_profile"),
    "create_timer": ("timer_period_sec", "callback"),
    "create_service": ("srv_type", "srv_name", "callback"),
    "create_client": ("srv_type", "srv_name"),
    "create_rate": ("frequency",),
}
#: Keywords that other releases and languages use -> the parameter that is meant.
KEYWORD_SLIPS = {
    **dict.fromkeys(("qos", "queue_size", "depth", "history", "queue", "qos_depth"), "qos_profile"),
    **dict.fromkeys(("period", "timer_period", "duration", "seconds", "interval"), "timer_period_sec"),
    **dict.fromkeys(("name", "topic_name", "service_name"), "topic"),
    **dict.fromkeys(("type", "message_type", "msg"), "msg_type"),
    **dict.fromkeys(("cb", "function", "func", "callback_function"), "callback"),
}
PUBLISHER = ("publish", "get_subscription_count", "wait_for_all_acked", "destroy", "assert_liveliness")
#: Functions that run callbacks.
SPINS = ("spin", "spin_once", "spin_until_future_complete", "spin_once_until_future_complete")
#: Methods of a logger that log.
LOG_METHODS = ("debug", "info", "warn", "warning", "error", "fatal")
LOGGER = (*LOG_METHODS, "set_level", "get_child", "log", "get_effective_level")

_STD = words(
    "Bool Byte Char Empty Float32 Float64 Header Int8 Int16 Int32 Int64 UInt8 UInt16 UInt32 UInt64 String ColorRGBA "
    "Float32MultiArray Float64MultiArray Int32MultiArray"
)
_GEOMETRY = words(
    "Accel Point Point32 PointStamped Polygon Pose Pose2D PoseArray PoseStamped PoseWithCovariance Quaternion "
    "PoseWithCovarianceStamped Transform TransformStamped Twist TwistStamped TwistWithCovariance Vector3 "
    "Vector3Stamped Wrench QuaternionStamped"
)
_SENSOR = words(
    "BatteryState CameraInfo CompressedImage FluidPressure Illuminance Image Imu JointState Joy LaserScan "
    "MagneticField NavSatFix PointCloud2 Range RelativeHumidity Temperature"
)
_QOS = words(
    "QoSProfile ReliabilityPolicy DurabilityPolicy HistoryPolicy LivelinessPolicy QoSReliabilityPolicy "
    "QoSDurabilityPolicy QoSHistoryPolicy qos_profile_sensor_data qos_profile_system_default"
)
#: Module -> names that it provides.
MODULES = {
    "std_msgs.msg": _STD,
    "geometry_msgs.msg": _GEOMETRY,
    "nav_msgs.msg": ("Odometry", "Path", "OccupancyGrid", "MapMetaData", "GridCells"),
    "sensor_msgs.msg": _SENSOR,
    "std_srvs.srv": ("SetBool", "Trigger"),
    "builtin_interfaces.msg": ("Time", "Duration"),
    "rclpy.node": ("Node",),
    "rclpy.qos": _QOS,
    "rclpy.executors": ("SingleThreadedExecutor", "MultiThreadedExecutor", "ExternalShutdownException"),
    "rclpy.callback_groups": ("ReentrantCallbackGroup", "MutuallyExclusiveCallbackGroup"),
    "rclpy.duration": ("Duration",),
    "rclpy.time": ("Time",),
    "rclpy.clock": ("Clock", "ClockType"),
    "rclpy.parameter": ("Parameter",),
    "rclpy.logging": ("get_logger", "LoggingSeverity"),
    "rclpy.exceptions": ("ParameterNotDeclaredException",),
    "threading": ("Thread", "Event", "Lock"),
    "functools": ("partial",),
    "datetime": ("datetime", "timedelta"),
}
#: Modules that are imported by their own name.
PLAIN_MODULES = ("rclpy", "time", "math", "random", "sys", "os", "threading", "datetime", "functools", "json", "signal")
_ALIASES = {"np": "import numpy as np", "numpy": "import numpy", "sleep": "from time import sleep"}
_ALIASES |= {"uniform": "from random import uniform", "randint": "from random import randint"}

#: Functions and numbers of Python's modules that students use, and often without the module.
FUNCTIONS = {
    "math": words(
        "sin cos tan asin acos atan atan2 sqrt pow exp log log10 floor ceil trunc fabs fmod hypot radians degrees pi "
        "tau inf nan isnan isinf isclose copysign dist"
    ),
    "random": words(
        "random uniform randint randrange choice choices sample shuffle gauss normalvariate triangular seed getrandbits"
    ),
    "time": words("time sleep monotonic perf_counter time_ns strftime localtime gmtime ctime process_time"),
    "rclpy": RCLPY,
}
#: How other languages write what Python knows under another name.
OTHER_SPELLINGS = {
    **dict.fromkeys(("true", "TRUE"), "True"),
    **dict.fromkeys(("false", "FALSE"), "False"),
    **dict.fromkeys(("null", "NULL", "nil", "none", "NONE", "Null", "nullptr", "undefined"), "None"),
    **dict.fromkeys(("this", "Self", "slef", "sefl"), "self"),
    **dict.fromkeys(("string", "String_"), "str"),
    **dict.fromkeys(("double", "Double"), "float"),
    "boolean": "bool",
    "printf": "print",
    "Print": "print",
    "elif_": "elif",
}

#: Path to a field that people look for in the wrong message.
FIELDS = {
    **{(m, f): f"msg.pose.pose.position.{f}" for m in ("Odometry", "PoseWithCovariance", "Pose") for f in ("x", "y")},
    **{(m, f): f"msg.pose.pose.{f}" for m in ("Odometry", "PoseWithCovariance") for f in ("position", "orientation")},
    **{(m, f): f"msg.twist.twist.{f}" for m in ("Odometry", "TwistWithCovariance") for f in ("linear", "angular")},
    ("Odometry", "data"): "msg.pose.pose.position",
    ("Twist", "x"): "msg.linear.x",
    ("Twist", "y"): "msg.linear.y",
    ("Twist", "z"): "msg.angular.z",
    ("Temperature", "data"): "msg.temperature",
}
_NUMBERS = ("Float32", "Float64", "Int8", "Int16", "Int32", "Int64", "UInt8", "UInt16", "UInt32", "UInt64", "String")
#: Fields of messages that beginners use.
MESSAGE_FIELDS = {
    "Twist": ("linear", "angular"),
    "Vector3": ("x", "y", "z"),
    "Point": ("x", "y", "z"),
    "Quaternion": ("x", "y", "z", "w"),
    "Odometry": ("header", "child_frame_id", "pose", "twist"),
    "PoseWithCovariance": ("pose", "covariance"),
    "TwistWithCovariance": ("twist", "covariance"),
    "Pose": ("position", "orientation"),
    "Temperature": ("header", "temperature", "variance"),
    "Trigger_Response": ("success", "message"),
    "SetBool_Request": ("data",),
    "SetBool_Response": ("success", "message"),
    **dict.fromkeys(_NUMBERS, ("data",)),
    "Bool": ("data",),
}
#: Messages with one field, which holds a number.
SINGLE_NUMBERS = frozenset(_NUMBERS) - {"String"}


def import_of(name: str) -> str:
    """Return the import statement for a name; empty if several modules or none have it."""
    if name in _ALIASES:
        return _ALIASES[name]
    if name in PLAIN_MODULES:
        return f"import {name}"
    if name in PACKAGES:
        return ""
    if name in ("sin", "cos", "tan", "sqrt", "pi", "radians", "degrees", "atan2"):
        return f"from math import {name}"
    homes = [module for module, names in MODULES.items() if name in names]
    return f"from {homes[0]} import {name}" if len(homes) == 1 else ""


def closest(name: str, candidates: Iterable[str], cutoff: float = 0.75) -> str:
    """Return the candidate that a name is very likely a misspelling of; empty if there is none."""
    name = name[:80]
    plain = {c.lower().replace("_", ""): c for c in sorted(set(candidates) - {name}) if len(c) <= 80}
    found = difflib.get_close_matches(name.lower().replace("_", ""), plain, n=1, cutoff=cutoff)
    return plain[found[0]] if found else ""


def article(name: str) -> str:
    """Return `a` or `an`, as it stands before a name."""
    return "an" if name[:1] in "AEIO" else "a"
