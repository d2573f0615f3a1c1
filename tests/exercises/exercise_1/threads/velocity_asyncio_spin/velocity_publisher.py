import asyncio
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Vel(Node):
    def __init__(self):
        super().__init__('vel')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)

    async def publish_forever(self):
        loop = asyncio.get_running_loop()
        due = loop.time()
        while rclpy.ok():
            msg = Twist()
            msg.linear.x = 0.5
            msg.angular.z = 0.1
            self.pub.publish(msg)
            self.get_logger().info('sent')
            due += 0.05
            await asyncio.sleep(max(0.0, due - loop.time()))

    async def spin_forever(self):
        while rclpy.ok():
            rclpy.spin_once(self, timeout_sec=0)
            await asyncio.sleep(0.01)


async def run():
    node = Vel()
    await asyncio.gather(node.publish_forever(), node.spin_forever())


def main():
    rclpy.init()
    try:
        asyncio.run(run())
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
