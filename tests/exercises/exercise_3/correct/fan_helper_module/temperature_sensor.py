import random
from climate import ClimateNode, FAN, TEMPERATURE, run


class Sensor(ClimateNode):
    def __init__(self):
        super().__init__('sensor', listens=FAN, speaks=TEMPERATURE)
        self.create_timer(0.2, lambda: self.say(round(random.uniform(20, 30), 1)))

    def heard(self, value):
        self.get_logger().info(f'fan speed = {value:.0f}')


if __name__ == '__main__':
    run(Sensor)
