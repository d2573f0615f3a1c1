"""The template environment, scripts and style sheets of HTML pages."""

from __future__ import annotations

import base64
import hashlib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from jinja2 import Environment, PackageLoader, StrictUndefined

from grader.core.errors import EnvironmentFault
from grader.reporting.escape import shown


def page_environment(package: str) -> Environment:
    """Return an environment for the templates of a package, with the filter `shown` for student text."""
    templates = Environment(
        loader=PackageLoader(package),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters["shown"] = shown
    return templates


_LIBRARIES = "vendor/echarts/dist/echarts.common.min.js", "vendor/@dagrejs/dagre/dist/dagre.min.js"
#: Licences of libraries whose file does not contain them; they ship together with the library.
_LICENCES = "vendor/echarts/licenses/LICENSE-d3", "vendor/@dagrejs/dagre/LICENSE"
_OWN = ("assets/charts.js", "assets/graphs.js", "assets/page.js")


@dataclass(frozen=True, slots=True)
class Bundle:
    """Everything a page needs besides its content."""

    script: str
    style: str

    @property
    def script_digest(self) -> str:
        """Digest of the script, as a Content-Security-Policy writes it."""
        return policy_digest(self.script)

    @property
    def script_name(self) -> str:
        """File name of the script when reports share it; it changes with the content."""
        return f"report-{_short(self.script)}.js"

    @property
    def style_name(self) -> str:
        """File name of the style sheet when reports share it; it changes with the content."""
        return f"report-{_short(self.style)}.css"


@cache
def bundle() -> Bundle:
    """Return the bundle of this version of the grader."""
    licences = "".join(f"/*\n{_read(name).strip()}\n*/\n" for name in _LICENCES)
    scripts = "".join(f"{_read(name).strip()}\n" for name in (*_LIBRARIES, *_OWN))
    return Bundle(f"{licences}{scripts}", _read("assets/report.css"))


def shared_assets() -> dict[str, bytes]:
    """Return file name -> content of the files that reports rendered with `assets=...` load."""
    made = bundle()
    return {made.script_name: made.script.encode(), made.style_name: made.style.encode()}


def _read(name: str) -> str:
    try:
        return files(__package__).joinpath(name).read_text(encoding="utf-8")
    except FileNotFoundError:
        text = f"grader/reporting/html/{name}: expected what installing the grader fetches, found no file"
        raise EnvironmentFault(text, "python3 -m pip install . in the checkout of the grader") from None


def policy_digest(text: str) -> str:
    """Return the digest of an inline script or style sheet, as a Content-Security-Policy writes it."""
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:12]
