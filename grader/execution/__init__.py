"""Runs scenarios and records traces; the only package that uses ROS, processes and clocks."""
