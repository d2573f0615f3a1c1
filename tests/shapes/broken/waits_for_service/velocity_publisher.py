import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist
from std_srvs.srv import Trigger


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.client = self.create_client(Trigger, '/motor/enable')
        while not self.client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info('waiting for /motor/enable')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, self.tick)

    def tick(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.pub.publish(msg)


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
