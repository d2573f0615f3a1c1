"""Runs inside a student's process, next to the student's file; imports rclpy and the standard library, but not grader.

The host does not know the rubric, points or expected values. It gives the student's unmodified file a clock that the
grader controls: whenever every thread of the process would block, it reports this and waits for the grader's answer.
"""
