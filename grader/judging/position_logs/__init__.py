"""Recognises logged positions: reads numbers and labels from text, and compares them with the current pose."""
