"""Reads rubric files as values of `grader.core`."""
