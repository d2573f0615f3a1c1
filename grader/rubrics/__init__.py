"""Turns rubric files, which authors write, into values of the core."""
