"""Recordings: on the wire between processes, and as files."""
