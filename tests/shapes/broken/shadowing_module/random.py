import rclpy

# first try with random numbers, not used any more
numbers = [4, 8, 15, 16, 23, 42]
