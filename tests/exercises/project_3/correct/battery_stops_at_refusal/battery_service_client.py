import time

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Planner(Node):
    """Ends at the first answer that it cannot use, and at the first low charge."""

    def __init__(self):
        super().__init__('planner')
        self.cli = self.create_client(Trigger, '/battery/get_status')
        while not self.cli.wait_for_service(1.0):
            self.get_logger().info('no service')

    def run(self):
        for n in range(5):
            future = self.cli.call_async(Trigger.Request())
            self.executor.spin_until_future_complete(future, 2.0)
            r = future.result()
            if r is None or not r.success:
                self.get_logger().fatal('no valid answer, I stop here')
                return
            self.get_logger().info(r.message)
            try:
                charge = float(r.message.split()[1][:-1])
            except (IndexError, ValueError):
                self.get_logger().fatal('no number in it, I stop here')
                return
            if not charge > 20:
                self.get_logger().warning('low battery: abort')
                return
            self.get_logger().info('battery OK: start')
            self.get_logger().info('asking again in a second')
            time.sleep(1)


rclpy.init()
planner = Planner()
executor = rclpy.executors.SingleThreadedExecutor()
executor.add_node(planner)
planner.run()
rclpy.try_shutdown()
