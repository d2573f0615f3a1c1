import time
import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Missions(Node):
    """Goes at full speed above 60 %, slowly above 20 %."""

    def __init__(self):
        super().__init__('missions')
        self.battery = self.create_client(Trigger, '/battery/get_status')

    def level(self):
        future = self.battery.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(self, future, timeout_sec=2)
        reply = future.result()
        if not reply or not reply.success:
            raise LookupError('no charge')
        return float(reply.message[len('Battery: '):reply.message.index('%')])


def main():
    rclpy.init()
    node = Missions()
    log = node.get_logger()
    while not node.battery.wait_for_service(1.0):
        log.info('the battery does not answer yet')
    for _ in range(5):
        try:
            level = node.level()
        except (LookupError, ValueError) as problem:
            log.error(f'no mission: {problem}')
        else:
            if level > 60:
                log.info('full speed ahead')
            elif level > 20:
                log.info('slowly ahead')
            else:
                log.warning('staying')
        time.sleep(1)


if __name__ == '__main__':
    main()
