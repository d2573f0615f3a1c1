"""What a built message package needs at run time; copied beside the packages, it imports nothing of the grader."""
