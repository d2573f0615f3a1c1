"""Two executors, one for what is urgent, after the official example."""
import threading

import rclpy
from rclpy.callback_groups import CallbackGroup, MutuallyExclusiveCallbackGroup
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import Int32


class OnlyEven(MutuallyExclusiveCallbackGroup):
    def __init__(self):
        super().__init__()
        self.asked = 0

    def can_execute(self, entity):
        self.asked += 1
        return super().can_execute(entity)


rclpy.init()
urgent, slow = rclpy.create_node("urgent"), rclpy.create_node("slow")
group = OnlyEven()
urgent.create_timer(0.5, lambda: urgent.get_logger().info("urgent"), callback_group=group)
heard = []
subscription = slow.create_subscription(Int32, "/count", lambda m: heard.append(m.data), 10)
slow.create_timer(1.2, lambda: slow.get_logger().info(f"heard some: {len(heard) > 0}"))
print(group.has_entity(subscription), isinstance(group, CallbackGroup), flush=True)
executors = []
for node in (urgent, slow):
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    executors.append(executor)
threading.Thread(target=executors[1].spin, daemon=True).start()
try:
    executors[0].spin()
finally:
    print(group.asked > 4)
