"""Hears of all changes with a parameter event handler, until it removes its callbacks."""
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_event_handler import ParameterEventHandler


class Listener(Node):
    def __init__(self):
        super().__init__("listener")
        self.declare_parameter("a", 1)
        self.declare_parameter("b", 1)
        self.handler = ParameterEventHandler(self)
        self.events = self.handler.add_parameter_event_callback(self.event)
        self.only_a = self.handler.add_parameter_callback("a", "listener", self.a_changed)
        self.count = 0
        self.create_timer(0.5, self.tick)

    def event(self, event):
        if event.node != "/listener":
            return
        found = ParameterEventHandler.get_parameters_from_event(event)
        self.get_logger().info("event: " + ", ".join(f"{p.name}={p.value.integer_value}" for p in found))
        one = ParameterEventHandler.get_parameter_from_event(event, "b", "/listener")
        self.get_logger().info(f"b: {one.value.integer_value if one else None}")

    def a_changed(self, parameter):
        self.get_logger().info(f"a is {parameter.value.integer_value}")

    def tick(self):
        self.count += 1
        self.set_parameters([Parameter("ab"[self.count % 2], value=self.count * 10)])
        if self.count == 4:
            self.handler.remove_parameter_callback(self.only_a)
            self.handler.remove_parameter_event_callback(self.events)


rclpy.init()
rclpy.spin(Listener())
