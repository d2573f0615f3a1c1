"""Grades a class: finds the submissions, grades them, stores results, and writes the overview."""
