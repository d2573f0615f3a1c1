import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger
import threading


class Server(Node):
    def __init__(self):
        super().__init__('server', namespace='battery')
        self.lock = threading.Lock()
        self.tenths = 850
        self.create_service(Trigger, 'get_status', self.status, callback_group=ReentrantCallbackGroup())

    def status(self, _request, response):
        with self.lock:
            self.tenths = self.tenths - 5 if self.tenths >= 5 else 1000
            now = self.tenths
        response.message = 'Battery: %d.%d%% remaining' % divmod(now, 10)
        response.success = True
        return response


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=3)
    executor.add_node(Server())
    try:
        executor.spin()
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
