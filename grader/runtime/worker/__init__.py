"""What runs in the worker: runners, the grader's own node, and what they record."""
