"""The questions that a rubric can ask of a trace; CHECKS is the table of all of them."""
