"""The command line of `grade`."""
