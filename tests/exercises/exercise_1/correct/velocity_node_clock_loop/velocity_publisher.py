import time
import rclpy
from rclpy.duration import Duration
from geometry_msgs.msg import Twist


def main():
    rclpy.init()
    node = rclpy.create_node('vel')
    pub = node.create_publisher(Twist, 'cmd_vel', 1)
    clock = node.get_clock()
    due = clock.now()
    while rclpy.ok():
        if clock.now() >= due:
            t = Twist()
            t.linear.x = 0.5
            t.angular.z = 0.1
            pub.publish(t)
            due = due + Duration(seconds=0.05)
            node.get_logger().info('t = %.2f' % (clock.now().nanoseconds / 1e9), throttle_duration_sec=0.5)
        time.sleep(0.001)


if __name__ == '__main__':
    main()
