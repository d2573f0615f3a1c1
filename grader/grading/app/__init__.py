"""Implements the commands: one module for each, as a list of stages."""
