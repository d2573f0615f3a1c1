import rclpy
from std_msgs.msg import Float64

FACTOR = 180 / 3.14159


def main():
    rclpy.init()
    node = rclpy.create_node('angles')
    log = node.get_logger()

    def cb(m):
        log.info('Radians: {}'.format(m.data))
        log.info('Degrees: {}'.format(m.data * FACTOR))

    node.create_subscription(Float64, 'joint_commands', cb, 1)
    while rclpy.ok():
        rclpy.spin_once(node)


main()
