import json
import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class JsonLogger(Node):
    def __init__(self):
        super().__init__('json_logger')
        self.state = {}
        self.create_subscription(Odometry, '/odom', self.on_odom, 10)
        self.create_timer(1.0, self.dump)

    def on_odom(self, msg):
        p = msg.pose.pose.position
        self.state = {'frame': msg.header.frame_id, 'x': round(p.x, 4), 'y': round(p.y, 4), 'z': p.z}

    def dump(self):
        if self.state:
            self.get_logger().info(json.dumps(self.state))


def main():
    rclpy.init()
    rclpy.spin(JsonLogger())


if __name__ == '__main__':
    main()
