"""Says that it has a new publisher at each tick, which the graph never shows."""

import gc

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


def links():
    """Return what in this process speaks to whoever started it."""
    gc.unfreeze()  # what was there before a fork
    return [o for o in gc.get_objects() if type(o).__name__ == "Link" and hasattr(o, "send")]


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.05, self.tick)
        self.get_logger().info("driving")
        self.ghosts, self.mine = 0, []
        for link in links():
            self.speak_for(link, link.send)

    def speak_for(self, link, send):
        def lie(report):
            if type(report).__name__ == "Idle":
                self.ghosts += 1
                said = report.progress
                self.mine = said.endpoints or self.mine
                ghost = type(self.mine[0])("publisher", f"/ghost_{self.ghosts}", "geometry_msgs/msg/Twist")
                report = report._replace(progress=said._replace(endpoints=[*self.mine, ghost]))
            send(report)

        link.send = lie

    def tick(self):
        message = Twist()
        message.linear.x = 0.5
        message.angular.z = 0.1
        self.publisher.publish(message)


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == "__main__":
    main()
