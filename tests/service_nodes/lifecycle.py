"""Publishes while it is active."""

import rclpy
from rclpy.lifecycle import Node, TransitionCallbackReturn
from std_msgs.msg import String


class Living(Node):
    def __init__(self):
        super().__init__("living")
        self.create_timer(0.5, self.tick)
        self.out = None

    def on_configure(self, state):
        self.out = self.create_lifecycle_publisher(String, "/out", 10)
        return TransitionCallbackReturn.SUCCESS

    def tick(self):
        if self.out is not None:
            self.out.publish(String(data="x"))


def main():
    rclpy.init()
    rclpy.spin(Living())


if __name__ == "__main__":
    main()
