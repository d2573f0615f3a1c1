import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Missions(Node):
    def __init__(self):
        super().__init__('missions')
        self.client = self.create_client(Trigger, '/battery/get_status')
        while not self.client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info('service not available, waiting again...')
        self.count = 0
        self.timer = self.create_timer(1.0, self.ask)

    def ask(self):
        if self.count == 5:
            self.timer.cancel()
            return
        self.count += 1
        response = self.client.call(Trigger.Request())
        level = float(response.message.split()[1].strip('%'))
        if response.success and level > 20.0:
            self.get_logger().info(f'mission {self.count} started')
        else:
            self.get_logger().warn(f'mission {self.count} aborted')


def main(args=None):
    rclpy.init(args=args)
    node = Missions()
    rclpy.spin(node)
    rclpy.shutdown()


if __name__ == '__main__':
    main()
