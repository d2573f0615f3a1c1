import itertools
import time

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class BatteryClient(Node):
    def __init__(self):
        super().__init__('battery_client')
        self.client = self.create_client(Trigger, '/battery/get_status')
        self.missions = itertools.cycle(['exploring', 'to the dock', 'delivery', 'patrol', 'cleaning'])
        while not self.client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info('waiting for the battery service')

    def percent(self):
        future = self.client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(self, future, timeout_sec=3.0)
        try:
            return float(future.result().message.split()[1].rstrip('%'))
        except (AttributeError, IndexError, ValueError):
            return None

    def decide(self):
        percent = self.percent()
        if percent is None:
            self.get_logger().error('no charge known')
        elif percent > 20.0:
            self.get_logger().info(next(self.missions))
        else:
            self.get_logger().warning(f'only {percent} %, mission aborted')


def main(args=None):
    rclpy.init(args=args)
    node = BatteryClient()
    for _ in range(5):
        node.decide()
        time.sleep(1.0)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
