"""The vocabulary of recording: traces, scenarios, submissions, limits and errors."""
