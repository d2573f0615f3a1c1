"""Walls around processes: what a worker and a student's process may see and reach."""
