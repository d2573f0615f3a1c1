import math
import rclpy
import rclpy.node
import std_msgs.msg


def main():
    rclpy.init()
    node = rclpy.node.Node('joint')
    state = {'n': 0}
    pub = node.create_publisher(std_msgs.msg.Float64, '/joint_commands', 10)

    def cb():
        msg = std_msgs.msg.Float64()
        msg.data = math.sin(state['n'] * 0.1)
        pub.publish(msg)
        if state['n'] % 10 == 1:
            node.get_logger().info('Published ten more')
        state['n'] += 1

    node.create_timer(0.1, cb)
    executor = rclpy.executors.SingleThreadedExecutor()
    executor.add_node(node)
    executor.spin()


import rclpy.executors
main()
