import rclpy
from rclpy.node import Node
from std_msgs.msg import Int32

class controller(Node):
    def __init__(self):
        super().__init__("controller")
        self.speed = None
        self.p = self.create_publisher(Int32, "fan_speed", 1)
        self.create_subscription(Int32, "temperature", self.temp, 1)

    def temp(self, m):
        new = 100 if m.data > 25 else 0
        if new != self.speed:      # only when something changes
            self.speed = new
            self.p.publish(Int32(data=new))
            self.get_logger().info("switching fan to %d" % new)

def main():
    rclpy.init()
    rclpy.spin(controller())
