import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Mission(Node):
    """Each tick looks at the answer to the last question, then asks again; success is not looked at."""

    def __init__(self):
        super().__init__('mission')
        self.cli = self.create_client(Trigger, '/battery/get_status')
        self.future = None
        self.asked = 0
        self.create_timer(1.0, self.tick)

    def tick(self):
        if not self.cli.service_is_ready():
            self.get_logger().info('waiting for the battery')
            return
        if self.future is not None and self.future.done():
            self.decide(self.future.result().message)
            self.future = None
        if self.asked < 5:
            self.asked += 1
            self.future = self.cli.call_async(Trigger.Request())

    def decide(self, text):
        try:
            charge = float(text.split(':')[1].split('%')[0])
        except (IndexError, ValueError):
            self.get_logger().error('cannot read: ' + text)
            return
        if charge > 20.0:
            self.get_logger().info(f'go, {charge}')
        else:
            self.get_logger().warning(f'no go, {charge}')


def main():
    rclpy.init()
    rclpy.spin(Mission())


if __name__ == '__main__':
    main()
