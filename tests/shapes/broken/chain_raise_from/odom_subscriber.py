import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class PositionError(Exception):
    """The position could not be read."""


class OdomReader(Node):
    """Stores the pose and logs it every second."""

    def __init__(self):
        super().__init__("odom_reader")
        self.last = None
        self.sub = self.create_subscription(Odometry, "odom", self.on_odom, 10)
        self.timer = self.create_timer(1.0, self.report)

    def on_odom(self, msg):
        try:
            self.last = (msg.pose.position.x, msg.pose.position.y)
        except Exception as error:
            raise PositionError("cannot read the odometry") from error

    def report(self):
        if self.last is not None:
            self.get_logger().info("x = %.3f, y = %.3f" % self.last)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomReader())


if __name__ == "__main__":
    main()
