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
    charges = []
    for i in range(5):
        log.info(f'--- mission {i + 1} ---')
        response = node.ask()
        if response is None or not response.success or '%' not in response.message:
            log.error('charge unknown, mission aborted')
            time.sleep(1)
            continue
        charges = [*charges[-1:], float(response.message.split()[1].rstrip('%'))]
        if sum(charges) / len(charges) > 20:
            log.info('charge is enough, mission starts')
        else:
            log.warning('charge is too low, mission aborted')
        time.sleep(1)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
