"""Recordings that are kept with what is needed to judge them again."""
