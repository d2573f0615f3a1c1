"""Sandboxes, which restrict what a worker and a student's process can access."""
