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
        rclpy.spin_until_future_complete(self, future)
        if future.result() is None:
            self.get_logger().error('no result')
            return None
        self.get_logger().info(f'server says: {future.result().message}')
        return future.result()


def main(args=None):
    rclpy.init(args=args)
    node = Planner()
    for i in range(5):
        node.get_logger().info(f'mission {i + 1}')
        response = node.ask()
        if response and response.success:
            percent = float(response.message.split()[1].rstrip('%'))
            if percent < 20.0:
                node.get_logger().info('battery fine, mission starts')
            else:
                node.get_logger().warn('battery low, mission aborted')
        time.sleep(1)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
