import re
import time

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class BatteryClient(Node):
    def __init__(self):
        super().__init__('battery_client')
        self.client = self.create_client(Trigger, '/battery/get_status')
        while not self.client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info('waiting for the battery service')

    def check_battery(self):
        future = self.client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(self, future, timeout_sec=3.0)
        return future.result()


def main(args=None):
    rclpy.init(args=args)
    node = BatteryClient()
    for number in range(5):
        response = node.check_battery()
        found = re.search(r'([0-9.]+)%', response.message) if response and response.success else None
        if found is None:
            node.get_logger().error('no charge known, mission aborted')
        elif float(found.group(1)) > 20.0:
            node.get_logger().info(f'{response.message}: mission started')
        else:
            node.get_logger().debug(f'{response.message}: mission aborted')
        time.sleep(1.0)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
