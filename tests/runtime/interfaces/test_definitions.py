"""Reading definitions: what is found, what is understood, and what is refused with place and fix."""

import os
from pathlib import Path

import pytest

from grader.runtime.interfaces.definitions import (
    MAXIMUM_DEFINITIONS,
    DefinitionError,
    DefinitionFile,
    FieldType,
    InterfacePackage,
    digest,
    files_in,
    find_packages,
    read_definition,
    read_definitions,
)

INSTALLED = {"std_msgs/msg/Header", "geometry_msgs/msg/Point"}


def of(text: str, kind: str = "msg", name: str = "Foo") -> InterfacePackage:
    return InterfacePackage("my_interfaces", (DefinitionFile(kind, name, text),))


def refusal(*packages: InterfacePackage) -> DefinitionError:
    with pytest.raises(DefinitionError) as caught:
        read_definitions(packages, INSTALLED)
    return caught.value


def write(folder: Path, name: str, text: str = "") -> None:
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")


def test_finds_packages_with_and_without_package_xml(tmp_path: Path) -> None:
    write(tmp_path, "ws/src/some_folder/package.xml", "<package><name>robot_msgs</name></package>")
    write(tmp_path, "ws/src/some_folder/msg/State.msg", "int32 a\n")
    write(tmp_path, "other_msgs/srv/Go.srv", "---\n")
    write(tmp_path, "other_msgs/src/node.py", "")
    packages = find_packages(tmp_path)
    assert [(each.name, [(d.kind, d.name) for d in each.definitions]) for each in packages] == [
        ("other_msgs", [("srv", "Go")]),
        ("robot_msgs", [("msg", "State")]),
    ]
    assert digest(packages) == digest(packages[::-1])


def test_a_folder_can_be_a_package_itself(tmp_path: Path) -> None:
    write(tmp_path, "my_msgs/action/Drive.action", "---\n---\n")
    assert [each.name for each in find_packages(tmp_path / "my_msgs")] == ["my_msgs"]


def test_links_out_of_the_folder_are_left_alone(tmp_path: Path) -> None:
    write(tmp_path, "secret.msg", "int32 a\n")
    (tmp_path / "handed_in" / "msg").mkdir(parents=True)
    (tmp_path / "handed_in" / "msg" / "Foo.msg").symlink_to(tmp_path / "secret.msg")
    assert find_packages(tmp_path / "handed_in") == ()


def test_what_colcon_made_or_ignores_is_no_source(tmp_path: Path) -> None:
    write(tmp_path, "src/a_msgs/msg/Foo.msg", "int32 a\n")
    write(tmp_path, "install/COLCON_IGNORE")
    write(tmp_path, "install/a_msgs/share/a_msgs/msg/Foo.msg", "int32 older\n")
    write(tmp_path, ".cache/b_msgs/msg/Foo.msg", "int32 a\n")
    assert [each.name for each in find_packages(tmp_path)] == ["a_msgs"]


def test_a_folder_that_is_named_counts_although_colcon_ignores_it(tmp_path: Path) -> None:
    """A hint says to name it where a program needs it."""
    write(tmp_path, "a_msgs/COLCON_IGNORE")
    write(tmp_path, "a_msgs/msg/Foo.msg", "int32 a\n")
    assert find_packages(tmp_path) == ()
    assert [each.name for each in find_packages(tmp_path / "a_msgs")] == ["a_msgs"]


def test_two_folders_that_define_a_package_differently_are_refused(tmp_path: Path) -> None:
    write(tmp_path, "one/a_msgs/msg/Foo.msg", "int32 a\n")
    write(tmp_path, "two/a_msgs/msg/Foo.msg", "int32 b\n")
    with pytest.raises(DefinitionError, match="two folders"):
        find_packages(tmp_path)


@pytest.mark.parametrize("name", ["json", "Robot_msgs", "a__b"])
def test_names_that_no_package_can_have_are_refused(tmp_path: Path, name: str) -> None:
    write(tmp_path, f"{name}/msg/Foo.msg")
    with pytest.raises(DefinitionError):
        find_packages(tmp_path)


def test_package_xml_with_entities_is_refused(tmp_path: Path) -> None:
    write(tmp_path, "a/package.xml", '<!DOCTYPE a [<!ENTITY b "c">]><package><name>&b;</name></package>')
    write(tmp_path, "a/msg/Foo.msg")
    with pytest.raises(DefinitionError, match="entities"):
        find_packages(tmp_path)


def test_reads_types_values_and_comments() -> None:
    text = """# About it
        std_msgs/Header header   # when
        Bar[<=3] bars
        string<=5[] names
        float64[9] matrix
        int32 count -7
        string[] words ["a, b", 'c']
        bool ON=true
        string GREETING="it's"
        uint8 HEX=0x1F
    """
    interface, _ = read_definitions([of(text), of("", name="Bar")], INSTALLED)
    (section,) = interface.sections
    assert [(each.type, each.name, each.value) for each in section.fields] == [
        (FieldType("std_msgs/msg/Header"), "header", None),
        (FieldType("my_interfaces/msg/Bar", array="bounded", size=3), "bars", None),
        (FieldType("string", 5, "unbounded"), "names", None),
        (FieldType("float64", array="fixed", size=9), "matrix", None),
        (FieldType("int32"), "count", -7),
        (FieldType("string", array="unbounded"), "words", ("a, b", "c")),
    ]
    assert [(each.name, each.value) for each in section.constants] == [("ON", True), ("GREETING", "it's"), ("HEX", 31)]


@pytest.mark.parametrize(
    ("text", "line", "problem", "fix"),
    [
        ("int32 a\nflaot64 x", 2, "'flaot64' is not a type", "did you mean float64?"),
        ("int x", 1, "'int' is not a type", "did you mean int32?"),
        ("\n\ngeometry_msgs/Piont p", 3, "no message geometry_msgs/Piont", "did you mean geometry_msgs/Point?"),
        ("Header h", 1, "no message my_interfaces/Header", "did you mean std_msgs/Header?"),
        ("nav2_msgs/Costmap c", 1, "no message nav2_msgs/Costmap", "bring the package"),
        ("int32", 1, "has no name", "a type and a name"),
        ("int32 Name", 1, "'Name' is not a valid field name", "lower-case letters"),
        ("int32 a__b", 1, "valid field name", "single underscores"),
        ("int32 a\nint32 a", 2, "used twice", "another"),
        ("uint8 A=256", 1, "'256' is not of type uint8", "from 0 to 255"),
        ("int32 a b", 1, "'b' is not of type int32", "whole number"),
        ("float64 X=nan", 1, "not a number", "0.5"),
        ("int32[2] a [1, 2, 3]", 1, "3 elements", "says 2"),
        ("int32<=5 a", 1, "greatest length", "int32[<=5]"),
        ("int32[0] a", 1, "length of 0", "from 1"),
        ("Foo other", 0, "contains itself", "number"),
        ("float64[2000000] a", 1, "more than 1000000 values", "shorter"),
        ("std_msgs/Header H=1", 1, "constant cannot have this type", "number"),
        ('string A="a', 1, "quotes", "close"),
        ("string A=a\\nb", 1, "control characters", "leave"),
        ("int32 lambda", 1, "word of Python", "another"),
        ("@{import os}", 1, "is not a type", "such as float64"),
        ("int32 a');import_os", 1, "valid field name", "lower-case letters"),
    ],
)
def test_a_mistake_is_told_with_line_and_fix(text: str, line: int, problem: str, fix: str) -> None:
    error = refusal(of(text))
    assert error.file == "msg/Foo.msg"
    assert error.line == line
    assert problem in error.problem
    assert fix in error.hint


@pytest.mark.parametrize(("kind", "text"), [("srv", "int32 a\n"), ("action", "---\n"), ("action", "---\n---\n---\n")])
def test_parts_of_services_and_actions_are_counted(kind: str, text: str) -> None:
    assert "lines '---'" in refusal(of(text, kind)).problem


def test_names_of_types_are_checked() -> None:
    assert "valid type name" in refusal(of("", name="foo")).problem


def test_nested_arrays_that_no_program_can_create_are_refused() -> None:
    package = InterfacePackage(
        "deep",
        tuple(DefinitionFile("msg", f"L{n}", f"L{n + 1}[100] a\n" if n < 8 else "int32 a\n") for n in range(9)),
    )
    assert "more than 1000000 values" in refusal(package).problem


def test_messages_nested_too_deeply_are_refused() -> None:
    package = InterfacePackage(
        "deep", tuple(DefinitionFile("msg", f"L{n}", f"L{n + 1} a\n" if n < 99 else "int32 a\n") for n in range(100))
    )
    assert "nested more than" in refusal(package).problem


def test_types_of_one_file_name_are_refused() -> None:
    package = InterfacePackage("twice", (DefinitionFile("msg", "Foo", ""), DefinitionFile("msg", "FOO", "")))
    assert "upper and lower case" in refusal(package).problem


def test_too_many_definitions_are_refused() -> None:
    many = tuple(DefinitionFile("msg", f"M{n}", "") for n in range(MAXIMUM_DEFINITIONS + 1))
    assert str(MAXIMUM_DEFINITIONS) in refusal(InterfacePackage("many", many)).problem


def test_unknown_types_are_no_matter_for_a_single_definition() -> None:
    read_definition("a", DefinitionFile("msg", "Foo", "b/Bar c\n"))


#: What names and values of a package end with: a problem that names them, never another exception.
ODD: dict[str, tuple[str, str, str]] = {
    # what is odd -> package.xml, file, text
    "a type of 220 characters": ("", "msg/" + "Ab" * 110 + ".msg", "int32 a\n"),
    "a type that is long in lower case": ("", "msg/" + "AbC" * 41 + ".msg", "int32 a\n"),
    "a package of 120 characters": (f"<package><name>{'p' * 120}</name></package>", "msg/Foo.msg", "int32 a\n"),
    "a package of 60,000 characters": (f"<package><name>{'p' * 60_000}</name></package>", "msg/Foo.msg", "int32 a\n"),
    "a file in Latin-1": ("", "msg/" + os.fsdecode(b"S\xe4y") + ".msg", "int32 a\n"),
    "a field of 12,000 characters": ("", "msg/Foo.msg", "int32 " + "a" * 12_000 + "\n"),
    "a constant of 12,000 characters": ("", "msg/Foo.msg", "int32 " + "A" * 12_000 + "=1\n"),
    "a type of a field of 12,000 characters": ("", "msg/Foo.msg", "A" * 12_000 + " a\n"),
    "a length of 5,000 digits": ("", "msg/Foo.msg", f"int32[{'0' * 10}1{'0' * 5000}] a\n"),
    "a value of 50,000 digits": ("", "msg/Foo.msg", f"int32 A={'9' * 50_000}\n"),
    "a list that is none": ("", "msg/Foo.msg", f"string[] a [{'x' * 9_000}\n"),
    "an unknown encoding": ("<?xml version='1.0' encoding='x-none'?><package/>", "msg/Foo.msg", "int32 [\n"),
    "a manifest of zeros": ("\0" * 99, "msg/Foo.msg", "int32 a\n"),
}


def digested_and_read(folder: Path) -> None:
    """Do what is done with the packages of a submission before they are built."""
    found = find_packages(folder)
    digest(found)
    read_definitions(found, INSTALLED)


@pytest.mark.parametrize(("manifest", "file", "text"), ODD.values(), ids=ODD)
def test_whatever_is_odd_in_a_package_is_a_mistake_with_a_place(
    tmp_path: Path, manifest: str, file: str, text: str
) -> None:
    """The sentence is short and valid text, and says what to do."""
    write(tmp_path, f"foo_msgs/{file}", text)
    if manifest:
        write(tmp_path, "foo_msgs/package.xml", manifest)
    with pytest.raises(DefinitionError) as caught:
        digested_and_read(tmp_path)
    message = caught.value.message
    message.encode()
    assert len(message) < 400
    assert caught.value.hint


def test_a_folder_with_the_name_of_a_definition_is_none(tmp_path: Path) -> None:
    """Nor is one that is called like a manifest."""
    (tmp_path / "foo" / "msg" / "Foo.msg").mkdir(parents=True)
    (tmp_path / "foo" / "package.xml").mkdir()
    assert files_in([tmp_path]) == []
    assert find_packages(tmp_path) == ()
