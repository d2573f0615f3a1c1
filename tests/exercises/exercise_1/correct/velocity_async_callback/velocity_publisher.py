import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class AsyncPublisher(Node):
    def __init__(self):
        super().__init__('async_publisher')
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.timer = self.create_timer(0.05, self.tick)

    async def tick(self):
        await self.send(0.5, 0.1)

    async def send(self, v, w):
        msg = Twist()
        msg.linear.x = v
        msg.angular.z = w
        self.pub.publish(msg)
        self.get_logger().info(f'v={v} w={w}')


def main():
    rclpy.init()
    rclpy.spin(AsyncPublisher())


if __name__ == '__main__':
    main()
