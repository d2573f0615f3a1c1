import rclpy
from rclpy.task import Future
from geometry_msgs.msg import Twist, Vector3

rclpy.init()
node = rclpy.create_node('vel')
pub = node.create_publisher(Twist, 'cmd_vel', 10)
never = Future()
n = 0
try:
    while not never.done():
        pub.publish(Twist(linear=Vector3(x=0.5, y=0.0, z=0.0), angular=Vector3(x=0.0, y=0.0, z=0.1)))
        n += 1
        if n % 100 == 0:
            node.get_logger().info(f'{n} commands sent')
        rclpy.spin_until_future_complete(node, never, timeout_sec=0.05)
except KeyboardInterrupt:
    pass
