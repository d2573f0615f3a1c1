"""Turns what students hand in, folders and archives, into values of the core."""
