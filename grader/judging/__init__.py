"""Turns traces into verdicts; pure functions over plain data."""
