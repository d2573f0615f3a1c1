"""Reads submissions, folders and archives, as values of `grader.runtime.model`."""
