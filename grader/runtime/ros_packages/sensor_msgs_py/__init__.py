"""Reads and makes messages of `sensor_msgs` with numpy."""
