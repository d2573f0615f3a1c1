"""Evidence: the recordings of one submission, in files that other tools can read and that judging verifies."""
