import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Planner(Node):
    """Asks from a timer."""

    def __init__(self):
        super().__init__('planner')
        self.client = self.create_client(Trigger, '/battery/get_status')
        while not self.client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info('waiting for the server')
        self.mission = 0
        self.timer = self.create_timer(1.0, self.next_mission)

    def get_charge(self):
        future = self.client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(self, future)
        return future.result()

    def next_mission(self):
        self.mission += 1
        if self.mission > 5:
            raise SystemExit
        answer = self.get_charge()
        if answer.success and float(answer.message[9:].split('%')[0]) > 20.0:
            self.get_logger().info(f'Mission {self.mission}: start')
        else:
            self.get_logger().warning(f'Mission {self.mission}: abort')


def main(args=None):
    rclpy.init(args=args)
    planner = Planner()
    try:
        rclpy.spin(planner)
    except SystemExit:
        pass
    planner.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
