"""Watches for jumps of the node's clock: there are none before `use_sim_time` and /clock."""
import rclpy
from rclpy.clock import JumpThreshold
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock


class Watches(Node):
    def __init__(self):
        super().__init__("watches")
        threshold = JumpThreshold(
            min_forward=Duration(seconds=0.5), min_backward=Duration(seconds=-0.5), on_clock_change=True
        )
        self.watching = self.get_clock().create_jump_callback(threshold, post_callback=self.jumped)
        self.out = self.create_publisher(Clock, "/clock", 10)
        self.seconds = iter([100, 100, 104, 104, 20])
        self.turn = 0
        self.system = rclpy.clock.Clock()
        self.create_timer(0.4, self.tick, clock=self.system)

    def jumped(self, jump):
        self.get_logger().info(f"jumped: {jump.clock_change.name} {round(jump.delta.nanoseconds / 1e9, 1)}")

    def tick(self):
        self.turn += 1
        if self.turn == 2:
            self.set_parameters([Parameter("use_sim_time", value=True)])
            self.get_logger().info(f"simulated: {self.get_clock().ros_time_is_active}")
        elif self.turn > 3:
            seconds = next(self.seconds, None)
            if seconds is None:
                self.set_parameters([Parameter("use_sim_time", value=False)])
                raise SystemExit
            message = Clock()
            message.clock.sec = seconds
            self.out.publish(message)


rclpy.init()
node = Watches()
print(node.get_clock().ros_time_is_active, flush=True)
rclpy.spin(node)
