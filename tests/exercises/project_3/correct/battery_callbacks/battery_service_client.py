import re

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Client(Node):
    """A timer asks, a callback decides; the node ends itself after the fifth answer."""

    def __init__(self):
        super().__init__('client')
        self.cli = self.create_client(Trigger, 'battery/get_status')
        self.asked = 0
        self.answered = 0
        self.done = False
        self.timer = self.create_timer(1.0, self.tick)

    def tick(self):
        if not self.cli.service_is_ready():
            self.get_logger().warn('battery service is not up', once=False)
            return
        if self.asked == 5:
            return
        self.asked += 1
        self.cli.call_async(Trigger.Request()).add_done_callback(self.decide)

    def decide(self, future):
        self.answered += 1
        reply = future.result()
        numbers = re.findall(r'[0-9]+\.[0-9]+', reply.message)
        if not reply.success or not numbers:
            self.get_logger().error('cannot read: ' + reply.message)
        elif float(numbers[0]) <= 20:
            self.get_logger().warn('%s %% is too little' % numbers[0])
        else:
            self.get_logger().info('go with %s %%' % numbers[0])
        self.done = self.answered >= 5


rclpy.init()
node = Client()
while rclpy.ok() and not node.done:
    rclpy.spin_once(node, timeout_sec=0.1)
node.destroy_node()
rclpy.shutdown()
