"""The report in the formats of grading platforms."""
