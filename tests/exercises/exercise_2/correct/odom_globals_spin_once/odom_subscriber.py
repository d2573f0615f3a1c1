import time
import rclpy
from nav_msgs.msg import Odometry

x = 0.0
y = 0.0
got = False

def odom_cb(m):
    global x, y, got
    x = m.pose.pose.position.x
    y = m.pose.pose.position.y
    got = True

rclpy.init()
node = rclpy.create_node("odom_sub")
node.create_subscription(Odometry, "/odom", odom_cb, 10)
last = time.time()
while rclpy.ok():
    rclpy.spin_once(node, timeout_sec=0.1)
    if time.time() - last >= 1.0:
        last = time.time()
        if got:
            node.get_logger().info(f"{[x, y]}")
