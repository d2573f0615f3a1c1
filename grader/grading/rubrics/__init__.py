"""Reads rubric files as values of `grader.grading.model`."""

import os

# No plugin of another package may read rubrics. Pydantic looks for some in everything that is installed, for each of
# its models: a fifth of the time that it takes to import them.
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
