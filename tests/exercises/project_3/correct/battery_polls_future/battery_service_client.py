import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Mission(Node):
    """Looks every tenth of a second whether the answer is there; gives up a question after three seconds."""

    def __init__(self):
        super().__init__('mission')
        self.client = self.create_client(Trigger, '/battery/get_status')
        self.future = None
        self.asked = 0
        self.ticks = 0
        self.create_timer(0.1, self.tick)

    def tick(self):
        self.ticks += 1
        if self.future is not None:
            if self.future.done():
                self.decide(self.future.result())
                self.future, self.ticks = None, 0
            elif self.ticks > 30:
                self.get_logger().error('no answer within 3 s, staying here')
                self.future, self.ticks = None, 0
        elif self.asked < 5 and self.ticks >= 9:
            if self.client.service_is_ready():
                self.asked += 1
                self.ticks = 0
                self.future = self.client.call_async(Trigger.Request())
            elif self.ticks % 10 == 0:
                self.get_logger().info('still no battery service')

    def decide(self, answer):
        number = ''.join(c for c in answer.message if c in '0123456789.')
        if not answer.success or not number.strip('.'):
            self.get_logger().error(f'useless answer: {answer.message!r}')
            return
        ok = float(number) > 20
        log = self.get_logger()
        text = f'mission {self.asked}: {number}%'
        log.info(text) if ok else log.warn(text)


def main():
    rclpy.init()
    try:
        rclpy.spin(Mission())
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
