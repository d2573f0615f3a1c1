import asyncio

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class FanController(Node):
    async def on_temperature(self, msg):
        self.out.publish(Float32(data=[0.0, 100.0][bool(msg.data > 25.0)]))

    def __init__(self):
        super().__init__('fan_controller')
        self.out = self.create_publisher(Float32, 'fan_speed', 10)
        self.create_subscription(Float32, 'temperature', self.on_temperature, 10)


async def spin(node):
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0)
        await asyncio.sleep(0.01)


def main():
    rclpy.init()
    try:
        asyncio.run(spin(FanController()))
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
