"""The vocabulary of grading: exercises, reports, charts and the options of a run."""
