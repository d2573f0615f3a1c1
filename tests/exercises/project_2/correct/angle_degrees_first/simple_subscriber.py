import math, rclpy
from rclpy.node import Node
from std_msgs.msg import Float64
class S(Node):
    def __init__(self):
        super().__init__('s')
        self.create_subscription(Float64, '/joint_commands', lambda m: self.get_logger().info(f'{math.degrees(m.data):6.2f}\u00b0 = {m.data:6.4f} rad'), 10)
def main():
    rclpy.init(); rclpy.spin(S())
if __name__ == '__main__':
    main()
