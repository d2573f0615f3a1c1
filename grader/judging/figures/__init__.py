"""Turns traces into figures of what the checks looked at; pure functions over plain data."""
