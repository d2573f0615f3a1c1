from rclpy.node import Node


class PeriodicNode(Node):
    period = 1.0

    def __init__(self, name):
        super().__init__(name)
        self.create_timer(self.period, self.every_period)

    def every_period(self):
        raise NotImplementedError
