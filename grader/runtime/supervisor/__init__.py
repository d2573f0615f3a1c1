"""What runs in the grader's own process to have something recorded: workers, sessions, and what the machine offers."""
