import asyncio
import rclpy
from nav_msgs.msg import Odometry

latest = None


def keep(msg):
    global latest
    latest = msg.pose.pose.position


async def spin(node):
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0.0)
        await asyncio.sleep(0.005)


async def log(node):
    while rclpy.ok():
        await asyncio.sleep(1.0)
        if latest is not None:
            node.get_logger().info(f'x={latest.x:.3f} y={latest.y:.3f}')


async def main():
    rclpy.init()
    node = rclpy.create_node('odom_subscriber')
    node.create_subscription(Odometry, '/odom', keep, 10)
    await asyncio.gather(spin(node), log(node))


if __name__ == '__main__':
    asyncio.run(main())
