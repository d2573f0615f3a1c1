import threading
import rclpy
from rclpy.executors import MultiThreadedExecutor
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from std_srvs.srv import Trigger


class Mission(Node):
    """A mission is prepared for half a second; to abort warns, but what is prepared starts all the same."""

    def __init__(self):
        super().__init__('mission')
        group = ReentrantCallbackGroup()
        self.cli = self.create_client(Trigger, '/battery/get_status', callback_group=group)
        self.asked = 0
        self.create_timer(1.0, self.tick, callback_group=group)

    def tick(self):
        if not self.cli.wait_for_service(timeout_sec=0.0):
            self.get_logger().info('waiting for the battery')
            return
        if self.asked == 5:
            return
        self.asked += 1
        response = self.cli.call(Trigger.Request())
        if not response.success or '%' not in response.message:
            self.get_logger().error('no charge known')
            return
        threading.Timer(0.5, self.get_logger().info, args=('the mission starts',)).start()
        if float(response.message.split()[1].rstrip('%')) <= 20.0:
            self.get_logger().warning('low battery, the mission is aborted')


def main():
    rclpy.init()
    executor = MultiThreadedExecutor()
    executor.add_node(Mission())
    executor.spin()


if __name__ == '__main__':
    main()
