"""Subcommands of `grade`, each with an attribute `command`."""
