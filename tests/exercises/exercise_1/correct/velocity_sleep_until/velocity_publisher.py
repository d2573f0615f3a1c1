import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Cmd(Node):
    def __init__(self):
        super().__init__('cmd')
        self.p = self.create_publisher(Twist, 'cmd_vel', 10)
        self.c = Clock(clock_type=ClockType.STEADY_TIME)

    def loop(self):
        t = self.c.now()
        while self.context.ok():
            m = Twist()
            m.linear.x = 5e-1
            m.angular.z = 1e-1
            self.p.publish(m)
            self.get_logger().debug('sent')
            self.get_logger().info('still going', throttle_duration_sec=2)
            t = t + Duration(seconds=0.05)
            self.c.sleep_until(t)


rclpy.init()
node = Cmd()
try:
    node.loop()
except KeyboardInterrupt:
    print('bye')
