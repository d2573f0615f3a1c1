"""A waitable of its own, which is ready whenever a guard condition was triggered."""
import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.guard_condition import GuardCondition
from rclpy.waitable import NumberOfEntities, Waitable


class Mailbox(Waitable):
    def __init__(self, node):
        super().__init__(MutuallyExclusiveCallbackGroup())
        self.condition = GuardCondition(None, None)  # not of the node: the executor waits for it through this waitable
        self.node, self.letters, self.index, self.ready = node, [], None, False
        node.add_waitable(self)

    def post(self, letter):
        self.letters.append(letter)
        self.condition.trigger()

    def is_ready(self, wait_set):
        self.ready = wait_set.is_ready("guard_condition", self.index)
        return self.ready

    def take_data(self):
        taken, self.letters = self.letters, []
        return taken

    async def execute(self, letters):
        self.node.get_logger().info(f"letters {letters}")

    def get_num_entities(self):
        return NumberOfEntities(num_gcs=1)

    def add_to_wait_set(self, wait_set):
        self.index = wait_set.add_guard_condition(self.condition.handle)


rclpy.init()
node = rclpy.create_node("post_office")
box = Mailbox(node)
names = iter("abcd")


def send():
    box.post(next(names, "last"))
    box.post("copy")


node.create_timer(0.6, send)
rclpy.spin(node)
