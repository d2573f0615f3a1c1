"""Turns files that people write, rubrics and submissions, into values of the model."""
