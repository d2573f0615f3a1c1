"""Finds what in the grader's code parses bytes, by its imports and calls."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from source_trees import nodes_in

PACKAGE = Path(__file__).resolve().parent.parent / "grader"
#: Module or function -> what it parses. A module stands for everything in it.
PARSERS: Mapping[str, str] = {
    **dict.fromkeys(
        ("ast.parse", "ast.literal_eval", "compile", "tokenize", "symtable", "codeop", "libcst", "copydetect"), "Python"
    ),
    # functions of the grader that parse what they are given, wherever they are called
    **dict.fromkeys(
        (
            *("grader.runtime.host.packages.parse", "grader.runtime.host.packages.parsed"),
            *("grader.runtime.programs.inert.read_inert", "grader.grading.judging.source.parsed_source"),
        ),
        "Python",
    ),
    "codecs": "text in any encoding",
    **dict.fromkeys(("exec", "eval", "runpy", "code.InteractiveInterpreter"), "Python that runs"),
    **dict.fromkeys(("json.load", "json.loads", "json.JSONDecoder", "json.tool"), "JSON"),
    **dict.fromkeys(("tomllib", "tomli"), "TOML"),
    **dict.fromkeys(("configparser", "string.Formatter"), "INI or templates"),
    **dict.fromkeys(("xml", "lxml", "html.parser", "defusedxml", "plistlib"), "XML"),
    **dict.fromkeys(("yaml", "ruamel"), "YAML"),
    **dict.fromkeys(
        ("zipfile", "tarfile", "zlib", "lzma", "bz2", "gzip", "libarchive", "shutil.unpack_archive"), "archives"
    ),
    **dict.fromkeys(("pickle", "marshal", "shelve", "copyreg"), "pickle"),
    **dict.fromkeys(("csv.reader", "csv.DictReader"), "CSV"),
    **dict.fromkeys(("struct.unpack", "struct.unpack_from", "struct.iter_unpack", "struct.Struct"), "binary"),
    **dict.fromkeys(
        ("rclpy.serialization.deserialize_message", "mcap", "mcap_ros2", "rosbags", "sqlite3"), "CDR or MCAP"
    ),
    **dict.fromkeys(("re.compile", "re.match", "re.search", "re.fullmatch", "re.findall"), "regular expressions"),
    **dict.fromkeys(("re.finditer", "re.sub", "re.split", "re.subn", "fnmatch", "glob"), "regular expressions"),
    **dict.fromkeys(("email", "urllib.parse", "http.client", "shlex.split", "shlex.shlex"), "headers or URLs"),
}


def parsers_of(path: Path) -> set[str]:
    """Return what a module parses."""
    nodes = nodes_in(path)
    names: dict[str, str] = {}
    for node in nodes:
        if isinstance(node, ast.Import):
            for alias in node.names:
                names[alias.asname or alias.name.partition(".")[0]] = (
                    alias.name if alias.asname else alias.name.partition(".")[0]
                )
        elif isinstance(node, ast.ImportFrom) and not node.level:
            for alias in node.names:
                names[alias.asname or alias.name] = f"{node.module}.{alias.name}"
    return {kind for name in _used(nodes, names) if (kind := _kind(name))}


def _used(nodes: Iterable[ast.AST], names: Mapping[str, str]) -> Iterator[str]:
    """Yield the full names of everything that a module imports or uses, and of built-in functions that it calls."""
    yield from names.values()
    for node in nodes:
        if isinstance(node, (ast.Attribute, ast.Name)):
            first, _, rest = _dotted(node).partition(".")
            if first in names:
                yield f"{names[first]}.{rest}" if rest else names[first]
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id not in names:
            yield node.func.id
        if isinstance(node, ast.Call) and _dotted(node.func).endswith("import_module") and node.args:
            yield str(getattr(node.args[0], "value", ""))
        if isinstance(node, ast.ImportFrom) and not node.level:
            yield str(node.module)


def _dotted(node: ast.AST) -> str:
    """Return a name with its dots; what is before the first dot may be any expression, and is then left out."""
    if isinstance(node, ast.Attribute):
        return f"{_dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


def _kind(name: str) -> str:
    parts = name.split(".")
    return next((PARSERS[p] for n in range(len(parts), 0, -1) if (p := ".".join(parts[:n])) in PARSERS), "")


def all_parsers() -> dict[str, set[str]]:
    """Return what each module of the grader parses, by its path in the repository; none without any."""
    found = {path: parsers_of(path) for path in sorted(PACKAGE.rglob("*.py"))}
    return {path.relative_to(PACKAGE.parent).as_posix(): kinds for path, kinds in found.items() if kinds}
