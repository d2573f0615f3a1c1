import threading
import rclpy
from geometry_msgs.msg import Twist

stop = threading.Event()


def work(pub, logger):
    msg = Twist()
    msg.linear.x = 0.5
    msg.angular.z = 0.1
    while not stop.wait(0.05):
        pub.publish(msg)
        logger.info('sent')


def main():
    rclpy.init()
    node = rclpy.create_node('v')
    worker = threading.Thread(target=work, args=(node.create_publisher(Twist, 'cmd_vel', 10), node.get_logger()))
    worker.start()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
    finally:
        stop.set()
        worker.join()


if __name__ == '__main__':
    main()
