import asyncio
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)

    async def publish_forever(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.get_logger().info('asyncio publisher started')
        loop = asyncio.get_running_loop()
        due = loop.time()
        while rclpy.ok():
            self.pub.publish(msg)
            due += 0.05
            await asyncio.sleep(due - loop.time())


def main():
    rclpy.init()
    try:
        asyncio.run(VelocityPublisher().publish_forever())
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
