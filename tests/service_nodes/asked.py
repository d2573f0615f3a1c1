"""A node that has a parameter and waits for nothing else."""

import rclpy


def main():
    rclpy.init()
    node = rclpy.create_node("asked")
    node.declare_parameter("size", 3)
    rclpy.spin(node)


main()
