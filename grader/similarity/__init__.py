"""Submissions that are alike once what everybody was given, and what everybody writes, is taken out."""
