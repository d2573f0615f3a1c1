"""Grades a rubric: mutates its reference solution as students err, and tells which criterion notices."""
