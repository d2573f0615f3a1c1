"""Three topics with different rates: a set needs one message of each, and each message is used once."""

import rclpy
from geometry_msgs.msg import PointStamped, PoseStamped, TwistStamped
from message_filters import ApproximateTimeSynchronizer, Subscriber
from rclpy.node import Node


class Three(Node):
    def __init__(self):
        super().__init__("three")
        kinds = {"point": PointStamped, "pose": PoseStamped, "twist": TwistStamped}
        self.ends = [Subscriber(self, kind, name) for name, kind in kinds.items()]
        self.sync = ApproximateTimeSynchronizer(self.ends, 20, 0.2)
        self.sync.registerCallback(self.together)
        self.out = {name: self.create_publisher(kind, name, 10) for name, kind in kinds.items()}
        self.kinds, self.seen = kinds, []
        for name, period in (("point", 0.1), ("pose", 0.2), ("twist", 0.4)):
            self.create_timer(period, lambda name=name: self.send(name))

    def send(self, name):
        message = self.kinds[name]()
        message.header.stamp = self.get_clock().now().to_msg()
        self.out[name].publish(message)

    def together(self, point, pose, twist):
        stamps = [m.header.stamp.sec + m.header.stamp.nanosec / 1e9 for m in (point, pose, twist)]
        self.seen.append(stamps)
        if len(self.seen) == 4:
            near = all(max(s) - min(s) < 0.2 for s in self.seen)
            once = all(len({s[n] for s in self.seen}) == 4 for n in range(3))
            self.get_logger().info(f"all near: {near}, each used once: {once}")
            raise SystemExit


rclpy.init()
rclpy.spin(Three())

# logs: all near: True, each used once: True
