"""Runs beside a student's file, in its process; uses the standard library and rclpy, and imports nothing of grader."""
