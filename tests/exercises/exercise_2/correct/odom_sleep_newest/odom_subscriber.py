import rclpy, time
from rclpy.node import Node
from nav_msgs.msg import Odometry

class O(Node):
    def __init__(self):
        super().__init__('o')
        self.pos = None
        # depth 1: after the nap only the newest message is left
        self.create_subscription(Odometry, 'odom', self.cb, 1)

    def cb(self, msg):
        self.pos = (msg.pose.pose.position.x, msg.pose.pose.position.y)

def main():
    rclpy.init()
    o = O()
    while rclpy.ok():
        rclpy.spin_once(o, timeout_sec=0.02)
        if o.pos:
            o.get_logger().info('pos %s' % (o.pos,))
        time.sleep(1.0)

if __name__ == '__main__':
    main()
