"""Finds similar submissions, ignoring handed-out code and code that many students write."""
