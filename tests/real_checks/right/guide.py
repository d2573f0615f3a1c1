"""Does a little of everything that checks ask about."""

import math

import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64, Int32, String

PLACES = {"kitchen": (2.0, 1.5), "office": (-1.0, 3.25)}


class Guide(Node):
    def __init__(self):
        super().__init__("guide")
        self.declare_parameter("speed", 0.5)
        self.count = 0
        self.heard = 0
        self.wave = self.create_publisher(Float64, "wave", 10)
        self.speed = self.create_publisher(Float64, "speed", 10)
        self.counter = self.create_publisher(Int32, "count", 10)
        self.goal = self.create_publisher(PoseStamped, "goal", 10)
        self.state = self.create_publisher(
            String, "state", QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        )
        self.create_subscription(String, "voice", self.on_voice, 10)
        self.create_subscription(Int32, "count", self.on_count, 10)
        self.create_subscription(Float64, "angle", self.on_angle, 10)
        self.create_timer(0.1, self.tick)
        self.get_logger().info("guide ready")
        self.state.publish(String(data="ready"))

    def tick(self):
        self.wave.publish(Float64(data=math.sin(0.1 * self.count)))
        self.counter.publish(Int32(data=self.count))
        self.speed.publish(Float64(data=self.get_parameter("speed").value))
        if self.count % 10 == 0:
            self.get_logger().info(f"wave is {math.sin(0.1 * self.count):.3f}")
        self.count += 1

    def on_count(self, msg):
        self.heard += 1

    def on_angle(self, msg):
        self.get_logger().info(f"angle {msg.data:.4f} rad, {math.degrees(msg.data):.2f} deg")

    def on_voice(self, msg):
        place = next((p for name, p in PLACES.items() if name in msg.data), None)
        if place is None:
            self.get_logger().warning(f"nobody knows the way: {msg.data}")
            return
        goal = PoseStamped()
        goal.header.frame_id = "map"
        goal.pose.position.x, goal.pose.position.y = place
        goal.pose.orientation.w = 1.0
        self.goal.publish(goal)


def main():
    rclpy.init()
    node = Guide()
    try:  # noqa: SIM105 - as the textbook writes it
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
