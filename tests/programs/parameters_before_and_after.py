"""A callback changes what is about to be set, another one acts after it was set; both are taken away later."""
import rclpy
from rclpy.parameter import Parameter

rclpy.init()
node = rclpy.create_node("hooks")
node.declare_parameter("percent", 0)


def clip(parameters):
    return [Parameter(p.name, value=max(0, min(100, p.value))) for p in parameters]


def after(parameters):
    print("set to", [p.value for p in parameters], flush=True)


node.add_pre_set_parameters_callback(clip)
node.add_post_set_parameters_callback(after)
values = [250, -3, 50, 400]


def tick():
    value = values.pop(0)
    node.set_parameters([Parameter("percent", value=value)])
    print("is", node.get_parameter("percent").value, flush=True)
    if len(values) == 1:
        node.remove_pre_set_parameters_callback(clip)
        node.remove_post_set_parameters_callback(after)
    if not values:
        timer.cancel()


timer = node.create_timer(0.5, tick)
rclpy.spin(node)
