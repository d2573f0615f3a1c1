"""Reads the package.xml of a ROS package as colcon does, in the contained process that can do nothing else."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree as ET
from xml.parsers import expat

#: The most packages and build types of a manifest, and characters of a name, that are told.
MOST_NAMES, NAME_CHARACTERS = 300, 100
#: Tags of which there is exactly one, and those of which there is at least one; none of them is empty.
_ONE, _SOME = ("name", "version", "description"), ("maintainer", "license")
_EMAIL = re.compile(r"[-a-zA-Z0-9_%+]+(\.[-a-zA-Z0-9_%+]+)*@[-a-zA-Z0-9%]+(\.[-a-zA-Z0-9%]+)*\.[a-zA-Z]{2,}")
_VERSION = re.compile(r"[0-9]+\.[0-9]+\.[0-9]+")
_COMMON = frozenset(
    {*_ONE, *_SOME, "url", "author", "build_depend", "buildtool_depend", "test_depend", "conflict", "replace", "export"}
)
#: The tags that a manifest may have, by its format: others make it invalid (REP 127, 140 and 149).
_SINCE_2 = {*_COMMON, "build_export_depend", "buildtool_export_depend", "depend", "exec_depend", "doc_depend"}
_TAGS = {"1": {*_COMMON, "run_depend"}, "2": _SINCE_2, "3": {*_SINCE_2, "group_depend", "member_of_group"}}
#: Dependencies that a program does not run with.
_APART = ("test_depend", "doc_depend")
#: Those that `depend` stands for: beside it, they are a mistake.
_MEANT = ("build_depend", "build_export_depend", "exec_depend")


def manifest_description(content: bytes) -> dict[str, Any]:
    """Return what a package.xml says: `problem`, a code and a name or null, `dependencies` and `build_types`.

    The codes are `xml`, with the line, `entities`, `root`, and, with a tag or text of the manifest, `format`, `number`,
    `empty`, `version`, `email`, `no_email`, `tag`, `twice` and `itself`.
    """
    root, problem = _root(content)
    if root is None:
        return {"problem": problem, "dependencies": [], "build_types": []}
    found = next(_problems(root), None)
    depends = (text for tag, text in _depends(root) if tag not in _APART)
    types = (_text(one) for export in root.findall("export") for one in export.findall("build_type"))
    return {
        "problem": None if found is None else [found[0], found[1][:NAME_CHARACTERS]],
        "dependencies": list(dict.fromkeys(text[:NAME_CHARACTERS] for text in depends))[:MOST_NAMES],
        "build_types": list(dict.fromkeys(text[:NAME_CHARACTERS] for text in types))[:MOST_NAMES],
    }


def _root(content: bytes) -> tuple[ET.Element | None, list[str]]:
    """Return the root of a manifest, or why there is none."""
    builder = ET.TreeBuilder()
    parser = expat.ParserCreate()
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    parser.EntityDeclHandler = _refuse
    try:
        parser.Parse(content, True)  # noqa: FBT003 - takes no keyword
        root = builder.close()
    except _EntitiesError:
        return None, ["entities", ""]
    except (expat.ExpatError, ValueError, LookupError):
        return None, ["xml", str(parser.ErrorLineNumber)]
    return (root, []) if root.tag == "package" else (None, ["root", ""])


class _EntitiesError(Exception):
    """A document declares entities, which may stand for texts of any length."""


def _refuse(*_: object) -> None:
    raise _EntitiesError


def _problems(root: ET.Element) -> Iterator[tuple[str, str]]:
    """Yield why colcon takes a manifest for none, each as a code and a tag or name."""
    tags = _TAGS.get(root.get("format", "1"))
    if tags is None:
        yield "format", root.get("format", "")
        return
    for tag in _ONE:
        if len(root.findall(tag)) != 1:
            yield "number", tag
    for tag in _SOME:
        if root.find(tag) is None:
            yield "number", tag
    yield from (("tag", one.tag) for one in root if one.tag not in tags)
    yield from (("empty", one.tag) for one in root if one.tag in (*_ONE, *_SOME) and not _text(one) and not len(one))
    if not _VERSION.fullmatch(_text(root.find("version"))):
        yield "version", _text(root.find("version"))
    written = [one.get("email", "") for one in root.findall("maintainer")]
    written += [email for one in root.findall("author") if (email := one.get("email")) is not None]
    yield from (("email" if email else "no_email", email) for email in written if not _EMAIL.fullmatch(email))
    depends = list(_depends(root))
    whole = {text for tag, text in depends if tag == "depend"}
    yield from (("twice", text) for tag, text in depends if tag in _MEANT and text in whole)
    name = _text(root.find("name"))
    yield from (("itself", name) for _, text in depends if text == name)


def _depends(root: ET.Element) -> Iterator[tuple[str, str]]:
    yield from ((one.tag, _text(one)) for one in root if one.tag.endswith("_depend") or one.tag == "depend")


def _text(element: ET.Element | None) -> str:
    return "" if element is None else (element.text or "").strip()
