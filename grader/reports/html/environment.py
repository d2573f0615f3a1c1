"""How our pages are made from templates: everything escaped, and nothing undefined."""

from __future__ import annotations

from jinja2 import Environment, PackageLoader, StrictUndefined

from grader.reports.escape import shown


def page_environment(package: str) -> Environment:
    """Return what renders the templates of a package, with the filter `shown` for what students wrote."""
    templates = Environment(
        loader=PackageLoader(package),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters["shown"] = shown
    return templates
