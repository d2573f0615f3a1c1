import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from std_srvs.srv import Trigger


class Mission(Node):
    """An async timer callback that awaits the answer."""

    def __init__(self):
        super().__init__('mission')
        self.client = self.create_client(Trigger, '/battery/get_status', callback_group=ReentrantCallbackGroup())
        self.count = 0
        self.create_timer(1.0, self.run)

    async def run(self):
        if self.count >= 5:
            return
        if not self.client.service_is_ready():
            self.get_logger().info('waiting for the battery server ...')
            return
        self.count += 1
        answer = await self.client.call_async(Trigger.Request())
        text = answer.message.replace('Battery:', '').replace('% remaining', '').strip()
        if answer.success and text.replace('.', '', 1).isdigit():
            if float(text) > 20.0:
                self.get_logger().info('Mission %d: go (%s)' % (self.count, text))
                return
            self.get_logger().warn('Mission %d: battery low (%s)' % (self.count, text))
            return
        self.get_logger().warn('Mission %d: no valid answer' % self.count)


def main():
    rclpy.init()
    rclpy.spin(Mission())


if __name__ == '__main__':
    main()
