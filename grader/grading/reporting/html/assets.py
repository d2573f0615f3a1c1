"""The template environment, scripts and style sheets of HTML pages."""

from __future__ import annotations

import base64
import hashlib
import re
from functools import cache
from importlib.resources import files

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

from grader.grading.reporting.escape import shown
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EnvironmentFault


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


@cache
def page_template(name: str) -> Template:
    """Return a template of the report page."""
    return page_environment("grader.grading.reporting.html").get_template(f"{name}.html")


def fill(page: str, place: str, **values: object) -> str:
    """Return a finished page with the template of a place in its header, instead of what was put there earlier.

    Every page holds `<!--PLACE--><!--/PLACE-->` once, before any text of a student; all other text is escaped. The
    values may be hostile.
    """
    made = f"<!--{place}-->{page_template(place).render(**values)}<!--/{place}-->"
    return re.sub(f"<!--{place}-->.*?<!--/{place}-->", lambda _: made, page, count=1, flags=re.DOTALL)


_LIBRARIES = "vendor/echarts/dist/echarts.common.min.js", "vendor/@dagrejs/dagre/dist/dagre.min.js"
#: Licences of libraries whose file does not contain them; they ship together with the library.
_LICENCES = "vendor/echarts/licenses/LICENSE-d3", "vendor/@dagrejs/dagre/LICENSE"
_OWN = ("assets/charts.js", "assets/graphs.js", "assets/player.js", "assets/page.js")


@dataclass(frozen=True, slots=True)
class Bundle:
    """Everything a page needs besides its content; pages that share it find it in two files."""

    name: str  # begins the names of the files, which change with the content
    script: str
    style: str

    @property
    def script_digest(self) -> str:
        """Digest of the script, as a Content-Security-Policy writes it."""
        return f"sha256-{base64.b64encode(hashlib.sha256(self.script.encode()).digest()).decode()}"

    @property
    def script_name(self) -> str:
        """File name of the script."""
        return f"{self.name}-{_short(self.script)}.js"

    @property
    def style_name(self) -> str:
        """File name of the style sheet."""
        return f"{self.name}-{_short(self.style)}.css"

    @property
    def files(self) -> dict[str, bytes]:
        """File name -> content."""
        return {self.script_name: self.script.encode(), self.style_name: self.style.encode()}


@cache
def bundle() -> Bundle:
    """Return the bundle of reports of this version of the grader."""
    licences = "".join(f"/*\n{_read(name).strip()}\n*/\n" for name in _LICENCES)
    scripts = "".join(f"{_read(name).strip()}\n" for name in (*_LIBRARIES, *_OWN))
    return Bundle("report", f"{licences}{scripts}", _read("assets/report.css"))


def _read(name: str) -> str:
    try:
        return files(__package__).joinpath(name).read_text(encoding="utf-8")
    except FileNotFoundError:
        text = f"grader/grading/reporting/html/{name}: expected what installing the grader fetches, found no file"
        raise EnvironmentFault(text, "python3 -m pip install . in the checkout of the grader") from None


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:12]
