"""A battery that drains while the robot drives, and is charged at the dock."""

import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from robot_interfaces.msg import Battery
from robot_interfaces.srv import Dock
from tf2_ros import StaticTransformBroadcaster


class BatteryNode(Node):
    """Publishes the charge once a second."""

    def __init__(self):
        super().__init__("battery")
        self.state = Battery(share=1.0)
        self.states = self.create_publisher(Battery, "/battery", 10)
        self.create_service(Dock, "/dock", self.on_dock)
        self.create_timer(1.0, self.on_timer)
        place = TransformStamped(child_frame_id="battery")
        place.header.frame_id = "base_link"
        self.frames = StaticTransformBroadcaster(self)
        self.frames.sendTransform(place)

    def on_dock(self, request, response):
        """Begin to charge at a known station."""
        self.state.charging = response.accepted = request.station == "home"
        self.get_logger().info(f"docked at {request.station}" if response.accepted else "no such station")
        return response

    def on_timer(self):
        """Drain or charge a percent."""
        change = 0.01 if self.state.charging else -0.01
        self.state.share = min(1.0, self.state.share + change)
        self.states.publish(self.state)


def main():
    """Run the node."""
    rclpy.init()
    try:
        rclpy.spin(BatteryNode())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
