"""Turns traces into verdicts; pure functions on plain data."""
