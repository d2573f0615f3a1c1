"""Prints who is there, like `ros2 node list` and `ros2 node info`."""
import rclpy
from rclpy.node import Node


class Info(Node):
    def __init__(self):
        super().__init__("info", namespace="/tools")
        self.create_timer(1.0, self.show)

    def show(self):
        shown = [name for name in self.get_fully_qualified_node_names() if "/_" not in name]
        print(sorted(shown), flush=True)
        print(self.get_namespace(), sorted({e for _, _, e in self.get_node_names_and_namespaces_with_enclaves()}), flush=True)
        for ask in (self.get_publisher_names_and_types_by_node, self.get_subscriber_names_and_types_by_node):
            print([name for name, _ in ask("partner", "/", no_demangle=False)], flush=True)
        print([n for n, _ in self.get_service_names_and_types_by_node("partner", "/") if "/partner/" not in n], flush=True)
        print(self.get_client_names_and_types_by_node("partner", "/"), flush=True)
        raise SystemExit


rclpy.init()
rclpy.spin(Info())
