"""Message packages built from their definitions, for rclpy, without compiler or CMake."""
