"""A class: who handed in what, each graded in a process of its own, results that stay, and what instructors open."""
