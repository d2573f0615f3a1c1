"""The commands `grade rubric ...`: what authors of rubrics need."""

from __future__ import annotations

import click


@click.group(name="rubric")
def command() -> None:
    """Write, check and explain rubrics."""
