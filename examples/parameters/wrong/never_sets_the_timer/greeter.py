"""Greets somebody, again and again; whom and how often are parameters."""

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class Greeter(Node):
    """Publishes `Hello NAME!` on /greeting."""

    def __init__(self):
        super().__init__("greeter")
        self.declare_parameter("name", "world")
        self.declare_parameter("period", 1.0)
        self.add_on_set_parameters_callback(self.on_change)
        self.publisher = self.create_publisher(String, "greeting", 10)
        self.timer = self.create_timer(self.get_parameter("period").value, self.greet)

    def greet(self):
        """Greet whom the parameter names now."""
        name = self.get_parameter("name").value
        self.publisher.publish(String(data=f"Hello {name}!"))

    def on_change(self, parameters):
        """Refuse a period that is none; set the timer to any other."""
        for parameter in parameters:
            if parameter.name == "period":
                if parameter.value <= 0:
                    return SetParametersResult(successful=False, reason="a period is above 0")
        return SetParametersResult(successful=True)


def main(args=None):
    """Run the node until Ctrl-C."""
    rclpy.init(args=args)
    node = Greeter()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
