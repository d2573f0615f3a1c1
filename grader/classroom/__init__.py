"""Grades a class: finds the submissions, grades each in its own process, stores results, and writes the overview."""
