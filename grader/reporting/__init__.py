"""Turns a report into the formats that people and programs read; pure functions."""
