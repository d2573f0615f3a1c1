import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__("odom_subscriber")
        self.p = None
        self.create_subscription(Odometry, "/odom", self.on_odom, 10)
        self.create_timer(1.0, self.show)

    def on_odom(self, msg):
        self.p = msg.pose.pose.position

    def show(self):
        if self.p is None:
            self.get_logger().info("position.......unknown")
            return
        self.get_logger().info(f"\n{'x':.<8}{self.p.x:.>8.3f}\n{'y':.<8}{self.p.y:.>8.3f}")


def main():
    rclpy.init()
    node = OdomSubscriber()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
