"""Tests a rubric: mutates its reference solution with typical mistakes, and finds out which criteria detect them."""
