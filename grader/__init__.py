"""Grades ROS 2 exercises: a run writes a trace, a trace is judged, a report is shown."""

__version__ = "0.2.0"
