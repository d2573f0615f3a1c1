"""Packs the grader for platforms that run it themselves."""
