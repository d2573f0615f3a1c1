"""Runs scenarios and writes traces; the only room that touches ROS, processes and clocks."""
