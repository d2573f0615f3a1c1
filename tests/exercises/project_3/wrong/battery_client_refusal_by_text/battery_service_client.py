import time
import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Planner(Node):
    def __init__(self):
        super().__init__('planner')
        self.client = self.create_client(Trigger, '/battery/get_status')
        while not self.client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info('service not there yet, waiting')
        self.get_logger().info('planner ready')

    def ask(self):
        future = self.client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(self, future, timeout_sec=3.0)
        return future.result()


def main():
    rclpy.init()
    node = Planner()
    log = node.get_logger()
    for i in range(5):
        log.info(f'--- mission {i + 1} ---')
        response = node.ask()
        if response is None or 'Battery' not in response.message or '%' not in response.message:
            log.error('refused, no mission')
            time.sleep(1)
            continue
        charge = float(response.message.split()[1].rstrip('%'))
        log.info(f'charge {charge}') if charge > 20 else log.warning(f'charge {charge}: aborted')
        if charge > 20:
            log.info('mission starts')
        time.sleep(1)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
