"""Reads rubric files as values of `grader.grading.model`."""
