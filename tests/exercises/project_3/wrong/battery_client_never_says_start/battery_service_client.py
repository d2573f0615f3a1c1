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
        if response is None:
            log.error('no answer')
        elif not response.success:
            log.error('refused')
        else:
            log.info(f'answer: {response.message}')
            if float(response.message.split()[1].rstrip('%')) <= 20:
                log.warn('too low, mission aborted')
        time.sleep(1)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
