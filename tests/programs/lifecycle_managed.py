"""A lifecycle node that goes through all transitions, with a publisher that is silent while inactive."""
import rclpy
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from std_msgs.msg import String


class Managed(LifecycleNode):
    def __init__(self):
        super().__init__("managed", enable_communication_interface=True)
        self.out = None
        self.steps = iter([self.trigger_configure, self.trigger_activate, self.trigger_deactivate, self.trigger_cleanup, self.trigger_shutdown])
        self.create_timer(0.5, self.step)
        self.number = 0

    def on_configure(self, state: LifecycleState):
        self.out = self.create_lifecycle_publisher(String, "state", 10)
        self.get_logger().info(f"configures from {state.label} {state.state_id}")
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state):
        self.get_logger().info("deactivates")
        return super().on_deactivate(state)

    def on_cleanup(self, state):
        self.destroy_lifecycle_publisher(self.out)
        self.out = None
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state):
        self.get_logger().info(f"shuts down from {state.label}")
        return TransitionCallbackReturn.SUCCESS

    def step(self):
        if self.out is not None:
            self.number += 1
            self.out.publish(String(data=f"{self.number} {self.out.is_activated}"))
        step = next(self.steps, None)
        if step is not None:
            self.get_logger().info(str(step()))


rclpy.init()
rclpy.spin(Managed())
