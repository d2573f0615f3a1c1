"""Evidence: what one submission's recordings hold, kept in files that other tools can read and that judging trusts."""
