import re
import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Mission(Node):
    """Remembers the last charge that could be read, and decides by it after each answer, whatever it says."""

    def __init__(self):
        super().__init__('mission')
        self.cli = self.create_client(Trigger, '/battery/get_status')
        self.charge = 0.0
        self.asked = 0
        self.create_timer(1.0, self.tick)

    def tick(self):
        if not self.cli.service_is_ready():
            self.get_logger().info('waiting for the battery')
        elif self.asked < 5:
            self.asked += 1
            self.cli.call_async(Trigger.Request()).add_done_callback(self.done)

    def done(self, future):
        found = re.search(r'\d+\.\d', future.result().message)
        if future.result().success and found:
            self.charge = float(found[0])
        if self.charge > 20:
            self.get_logger().info('mission started')
        else:
            self.get_logger().warning('mission aborted')


def main():
    rclpy.init()
    rclpy.spin(Mission())


if __name__ == '__main__':
    main()
