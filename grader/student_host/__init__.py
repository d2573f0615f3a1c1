"""Runs beside a student's file, in its process; uses the standard library and rclpy, and imports nothing of grader.

The host knows no rubric, no points and no expected value. It gives the student's unmodified file a clock that belongs
to the grader: whenever every thread of the process would block, it tells the grader so, and waits to be told the time.
"""
