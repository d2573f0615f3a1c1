import time
import rclpy
from geometry_msgs.msg import Twist


def forward(speed, turn):
    t = Twist()
    t.linear.x = speed
    t.angular.z = turn
    return t


def main():
    rclpy.init()
    node = rclpy.create_node('teleop')
    pub = node.create_publisher(Twist, 'cmd_vel', 10)
    node.get_logger().info('lets go')
    n = 0
    try:
        while rclpy.ok():
            pub.publish(forward(0.5, 0.1))
            n += 1
            if n % 20 == 0:
                node.get_logger().info(f'{n} commands sent')
            time.sleep(0.05)
    except KeyboardInterrupt:
        print('bye')
    finally:
        pub.publish(Twist())


if __name__ == '__main__':
    main()
