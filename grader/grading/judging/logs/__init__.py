"""What a process wrote, and whether that shows a number, a text or a list."""
