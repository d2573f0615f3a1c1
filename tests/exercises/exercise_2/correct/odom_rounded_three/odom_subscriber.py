import rclpy
from nav_msgs.msg import Odometry

pos = None


def odom_cb(msg):
    global pos
    pos = [round(v, 2) for v in (msg.pose.pose.position.x, msg.pose.pose.position.y, msg.pose.pose.position.z)]


def timer_cb():
    if pos != None:
        node.get_logger().info('Current position: ' + str(pos))


def main():
    global node
    rclpy.init()
    node = rclpy.create_node('odom_subscriber')
    sub = node.create_subscription(Odometry, '/odom', odom_cb, 10)
    tmr = node.create_timer(1.0, timer_cb)
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        print('Shutting down')
    finally:
        node.destroy_node()
        if rclpy.ok():
            rclpy.shutdown()


if __name__ == '__main__':
    main()
