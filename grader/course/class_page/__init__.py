"""The page of a class: every student's standing, where points were lost, and why; rendered from plain values."""
