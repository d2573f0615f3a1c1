"""Grades a class: finds the submissions, grades them in processes of their own, stores results, and writes the overview."""
