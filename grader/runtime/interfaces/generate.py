"""Writes the Python packages of definitions with ROS's own generators; a program of its own, for build.py.

`python -m grader.runtime.interfaces.generate PREFIX SHARE...` reads the definitions in PREFIX/share and writes
PREFIX/python.
SHARE are the share folders of the installed packages that they may refer to.
"""

from __future__ import annotations

import compileall
import importlib
import json
import pathlib
import shutil
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import rosidl_generator_type_description as descriptions
from rosidl_parser import definition as idl
from rosidl_pycommon import convert_camel_case_to_lower_case_underscore as snake_case
from rosidl_pycommon import expand_template

from grader.runtime.interfaces.definitions import (
    SECTIONS,
    DefinitionError,
    FieldType,
    Interface,
    Section,
    find_packages,
    read_definitions,
)

RUNTIME = "_grader_interfaces"
_BASIC = {"bool": "boolean", "byte": "octet", "char": "uint8", "float32": "float", "float64": "double"}
#: What the classes of a service or action are called after its name, and which of them are exported.
_PARTS = {
    "msg": ("",),
    "srv": ("", "_Event", "_Request", "_Response"),
    "action": (
        "",
        "_GetResult_Event",
        "_GetResult_Request",
        "_GetResult_Response",
        "_SendGoal_Event",
        "_SendGoal_Request",
        "_SendGoal_Response",
    ),
}


class InstalledTypes:
    """The type descriptions of installed packages, read from their files when they are asked for."""

    def __init__(self, shares: Iterable[Path]) -> None:
        self._shares = tuple(shares)

    def names(self) -> set[str]:
        """Full names of all messages that can be referred to."""
        return {f"{path.parts[-3]}/msg/{path.stem}" for share in self._shares for path in share.glob("*/msg/*.json")}

    def load(self, name: str) -> dict[str, Any]:
        """The content of the description file of a type."""
        path = next(path for share in self._shares if (path := share / f"{name}.json").is_file())
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return content

    def built(self) -> tuple[Path, ...]:
        """The folders of Python packages of those that were built like these."""
        return tuple(path for share in self._shares if ((path := share.parent / "python") / RUNTIME).is_dir())

    def templates(self) -> Path:
        """The folder of the templates that make Python classes."""
        return next(path for share in self._shares if (path := share / "rosidl_generator_py" / "resource").is_dir())


def generate(prefix: Path, installed: InstalledTypes) -> None:
    """Write the packages, their type descriptions and the runtime below a prefix that holds their definitions."""
    packages = find_packages(prefix / "share")
    interfaces = read_definitions(packages, installed.names())
    elements = {interface.name: _element(interface) for interface in interfaces}
    _write_descriptions(prefix, elements, installed)
    for package in packages:
        own = [interface for interface in interfaces if interface.package == package.name]
        _write_package(prefix / "python" / package.name, package.name, own, elements, installed.templates())
    runtime = Path(__file__).with_name("runtime")
    shutil.copytree(runtime, prefix / "python" / RUNTIME, ignore=shutil.ignore_patterns("__pycache__"))
    compileall.compile_dir(prefix / "python", quiet=2)
    sys.path[:0] = map(str, (prefix / "python", *installed.built()))
    for interface in interfaces:
        _try(interface)


def _try(interface: Interface) -> None:
    """Load the classes of an interface, and encode a message of each. Raises DefinitionError if that does not work."""
    definition = interface.definition
    try:
        module = importlib.import_module(f"{interface.package}.{definition.kind}._{snake_case(definition.name)}")
        codec = importlib.import_module(f"{RUNTIME}.codec")
        for made in list(vars(module).values()):
            if hasattr(made, "SLOT_TYPES"):
                codec.codec_of(made).to_bytes(made())
    except Exception as error:
        problem = f"Python cannot load it ({type(error).__name__}: {error})"
        raise DefinitionError(interface.package, interface.file, 0, problem, "choose other names") from error


def _element(interface: Interface) -> Any:
    """What rosidl_parser makes of the same definition in IDL."""
    definition = interface.definition
    namespaces = [interface.package, definition.kind]
    messages = [
        _message(idl.NamespacedType(namespaces, definition.name + suffix), section)
        for suffix, section in zip(SECTIONS[definition.kind], interface.sections, strict=True)
    ]
    if definition.kind == "msg":
        return messages[0]
    whole = idl.NamespacedType(namespaces, definition.name)
    return idl.Service(whole, *messages) if definition.kind == "srv" else idl.Action(whole, *messages)


def _message(name: idl.NamespacedType, section: Section) -> Any:
    structure = idl.Structure(name)
    for field in section.fields:
        member = idl.Member(_type(field.type), field.name)
        if field.value is not None:
            value = repr(field.value) if isinstance(field.value, tuple) else field.value
            member.annotations.append(idl.Annotation("default", {"value": value}))
        structure.members.append(member)
    if not structure.members:
        structure.members.append(idl.Member(idl.BasicType("uint8"), idl.EMPTY_STRUCTURE_REQUIRED_MEMBER_NAME))
    message = idl.Message(structure)
    message.constants += [idl.Constant(each.name, _type(each.type), each.value) for each in section.constants]
    return message


def _type(type_: FieldType) -> Any:
    if not type_.primitive:
        package, _, name = type_.base.split("/")
        element: Any = idl.NamespacedType([package, "msg"], name)
    elif type_.base == "string":
        element = idl.BoundedString(type_.string_bound) if type_.string_bound else idl.UnboundedString()
    elif type_.base == "wstring":
        element = idl.BoundedWString(type_.string_bound) if type_.string_bound else idl.UnboundedWString()
    else:
        element = idl.BasicType(_BASIC.get(type_.base, type_.base))
    if type_.array == "fixed":
        return idl.Array(element, type_.size)
    if type_.array == "bounded":
        return idl.BoundedSequence(element, type_.size)
    return idl.UnboundedSequence(element) if type_.array else element


def _write_descriptions(prefix: Path, elements: Mapping[str, Any], installed: InstalledTypes) -> None:
    """Write share/PACKAGE/KIND/NAME.json of each type, as an installed package has it."""
    own: dict[str, Any] = {}
    for element in elements.values():
        _add(element, own)
    types = {
        name: descriptions.serialize_individual_type_description(each.namespaced_type, each.members)
        for name, each in own.items()
    }
    hashes: dict[str, str] = {}
    pending = [field["type"]["nested_type_name"] for each in types.values() for field in each["fields"]]
    for name in pending:
        if name and name not in types:
            content = installed.load(name)
            message = content["type_description_msg"]
            for each in (message["type_description"], *message["referenced_type_descriptions"]):
                types.setdefault(each["type_name"], each)
            hashes.update({each["type_name"]: each["hash_string"] for each in content["type_hashes"]})
    full = {name: descriptions.extract_full_type_description(name, types) for name in own}
    hashes.update({name: descriptions.calculate_type_hash(each) for name, each in full.items()})
    for name in elements:
        names = [name, *(each["type_name"] for each in full[name]["referenced_type_descriptions"])]
        content = {
            "type_description_msg": full[name],
            "type_hashes": [{"type_name": each, "hash_string": hashes[each]} for each in names],
        }
        (prefix / "share" / f"{name}.json").write_text(json.dumps(content, indent=2), encoding="utf-8")


def _add(element: Any, own: dict[str, Any]) -> None:
    if isinstance(element, idl.Message):
        descriptions.add_msg(element, own)
    elif isinstance(element, idl.Service):
        descriptions.add_srv(element, own)
    else:
        descriptions.add_action(element, own)


def _write_package(
    folder: Path, package: str, interfaces: list[Interface], elements: Mapping[str, Any], templates: Path
) -> None:
    folder.mkdir(parents=True)
    (folder / "__init__.py").touch()
    endings: dict[str, tuple[str, str, str]] = {}
    for kind in sorted({interface.definition.kind for interface in interfaces}):
        exports: dict[str, str] = {}
        for interface in interfaces:
            name = interface.definition.name
            if interface.definition.kind != kind:
                continue
            stem = snake_case(name)
            exports[stem] = name
            content = idl.IdlContent()
            content.elements.append(elements[interface.name])
            data = {
                "package_name": package,
                "interface_path": pathlib.PurePosixPath(kind, f"{name}.idl"),
                "content": content,
                "type_description_info": None,
                "type_source_file": None,
            }
            expand_template("_idl.py.em", data, str(folder / kind / f"_{stem}.py"), template_basepath=templates)
            every: dict[str, Any] = {}
            _add(elements[interface.name], every)
            for type_name in every:
                part = type_name.rsplit("/", 1)[1]
                endings[f"{kind}__{snake_case(part)}"] = (f"{kind}/{name}", f"_{stem}", part)
        lines = [
            f"from {package}.{kind}._{stem} import {exports[stem]}{part}  # noqa: F401"
            for stem in sorted(exports)
            for part in _PARTS[kind]
        ]
        (folder / kind / "__init__.py").write_text("\n".join((*lines, "")), encoding="utf-8")
    entry = folder / f"{package}_s__rosidl_typesupport_c.py"
    listed = "".join(f"    {ending!r}: {endings[ending]!r},\n" for ending in sorted(endings))
    entry.write_text(
        f'"""Type support of {package}, without compiled code."""\n\nfrom pathlib import Path\n\n'
        f"from {RUNTIME}.type_support import TypeSupport\n\n"
        f'_SHARE = Path(__file__).parents[2] / "share" / {package!r}\n'
        f"__getattr__ = TypeSupport({package!r}, _SHARE, {{\n{listed}}})\n",
        encoding="utf-8",
    )


if __name__ == "__main__":
    try:
        generate(Path(sys.argv[1]), InstalledTypes(map(Path, sys.argv[2:])))
    except DefinitionError as wrong:
        sys.stdout.write(json.dumps([wrong.package, wrong.file, wrong.line, wrong.problem, wrong.fix]))
