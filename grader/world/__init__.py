"""Own nodes in virtual time, driven step by step: from a test, a script or a notebook."""
