"""A trace and a rubric become a report."""
