"""Groups its parameters by prefix, and asks for their types."""
import rclpy
from rclpy.parameter import Parameter

rclpy.init()
node = rclpy.create_node("grouped", enable_rosout=False, use_global_arguments=False)
node.declare_parameters("wheel", [("left", 0.1), ("right", 0.2), ("names", ["l", "r"])])
node.declare_parameter("body", True)


def show():
    timer.cancel()
    for name, parameter in sorted(node.get_parameters_by_prefix("wheel").items()):
        print(name, parameter.value, parameter.type_.name, flush=True)
    print(node.get_parameter_type("body") == Parameter.Type.BOOL.value, flush=True)
    print([Parameter.Type(kind).name for kind in node.get_parameter_types(["body", "wheel.names"])], flush=True)
    found = node.list_parameters(["wheel"], 2)
    print(sorted(found.names), found.prefixes, flush=True)


timer = node.create_timer(0.7, show)
rclpy.spin(node)
