"""Causes of files that Python cannot read, and of missing names and modules."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence

from grader.grading.judging.diagnosis.names import (
    MODULES,
    PACKAGES,
    PLAIN_MODULES,
    ROS_1,
    ROS_1_CALLS,
    closest,
    import_of,
)
from grader.grading.judging.diagnosis.rules import Clue, Crash, crash_rule
from grader.grading.judging.source import Source, argument, chain, covers, last_name, literal_text
from grader.grading.model.exercise import Location
from grader.grading.model.wording import named, quote
from grader.runtime.model.submission import EXPORT_NOTEBOOK
from grader.runtime.model.trace import Fault, FaultKind, StartWay

_PRINT = re.compile(r"^\s*print\s+(?P<what>[^(].*)$")
_OPERATORS = ((r"\belse\s+if\b", "elif"), (r"&&", "and"), (r"\|\|", "or"), (r"\+\+\s*$", "+= 1"))
#: Message of Python -> what to do; the first match wins.
_SAYINGS: Sequence[tuple[str, str]] = (
    (r"^TabError", "indent every line with four spaces a level: this one mixes tabs and spaces"),
    (r"expected ':'", "a colon is missing at the end of: {code}"),
    (r"unindent does not match", "the line begins with {indent}: indent it exactly as the other lines of its block"),
    (r"unexpected indent", "the line begins with {indent}, more than its block: indent it as the line above"),
    (r"expected an indented block after", "indent what belongs to the line above, or write pass there"),
    (r"'(.)' was never closed", "a bracket that is opened here is never closed: {code}"),
    (r"unmatched '(.)'", "there is one closing bracket too many: {code}"),
    (r"does not match opening parenthesis", "the brackets do not match: {code}"),
    (
        r"invalid character '.' \(U\+(2018|2019|201C|201D|00B4|201E)\)",
        "these are typographic quotes; type them again as ' or \"",
    ),
    (r"invalid non-printable character", "an invisible character was copied along: type the line again"),
    (r"unterminated (triple-quoted )?string literal", "the closing quote of the string is missing: {code}"),
    (r"cannot assign to (?:function call|literal|expression)", "only a name can be on the left of =: {code}"),
    (r"expected '\('", "a function name has no space or hyphen, and parentheses follow it: {code}"),
    (r"Maybe you meant '==' or ':=' instead|Maybe you meant '==' instead", "to compare, write == instead of ="),
    (r"Perhaps you forgot a comma", "a comma is probably missing in: {code}"),
    (r"'return' outside function", "return is outside a function: indent it like the function's other lines"),
    (r"'(?:yield|await)' outside", "yield works only in functions, await only in those with async def"),
    (
        r"'(break|continue)' (?:outside|not properly in) loop",
        "break and continue work only in loops: to leave a function, write return",
    ),
    (
        r"name '(\w+)' is (?:used|assigned to) (?:prior to|before) global",
        "global comes first: make it the first line of the function",
    ),
    (r"positional argument follows keyword", "keyword arguments such as x=1 come last: {code}"),
    (r"keyword argument repeated", "one keyword is given twice in: {code}"),
    (
        r"(?:non-default argument|parameter without a default) follows",
        "parameters with a default such as x=1 come last: {code}",
    ),
    (r"duplicate argument", "two parameters have the same name in: {code}"),
    (
        r"cannot assign to (?:function call|literal|expression|True|False|None)",
        "only a name can be on the left of =: {code}",
    ),
    (r"illegal target for annotation|only single target", "a value is assigned with =, not with a colon: {code}"),
    (r"invalid decimal literal", "a name cannot begin with a digit, nor a number end with letters: {code}"),
    (r"leading zeros", "an integer cannot begin with 0: {code}"),
    (r"unexpected character after line continuation", "a backslash must be the last character of its line: {code}"),
    (r"expected 'except' or 'finally' block", "try needs an except or finally after it, indented like the try"),
    (
        r"f-string: (?:expecting '}'|single '}'|empty expression|valid expression)",
        "the braces of the f-string do not match: {code}",
    ),
    (r"unicodeescape", "a backslash in a string starts an escape sequence: write r'...', or / in paths"),
    (r"'elif' block follows|invalid syntax.*'else'", "elif comes before else"),
    (
        r"unexpected EOF|was never closed|EOF while scanning",
        "a bracket or a string is not closed before the end of the file",
    ),
    (r"no binding for nonlocal|nonlocal declaration", "write global instead of nonlocal, or keep the value in self"),
    (r"invalid character '(.)'", "the character {found} is not valid in a program: type it again"),
)
#: What only the row shows, where Python says no more than "invalid syntax"; the first pattern that fits wins.
_ROWS: Sequence[tuple[str, str]] = (
    (r"[(,]\s*/\w", "a topic is a string: put it in quotes, '/name'"),
    (
        r"^\s*(?:function|func|void|int|double|float)\s+\w+\s*\(",
        "a function begins with def, and ends its first line with a colon",
    ),
    (r"^\s*(?:elseif|elsif|else if)\b", "in Python this is written elif"),
    (r"^\s*def\s+\w+\s*:", "parentheses are missing after the function name: def name(self):"),
    (r"^\s*(?:class|def)\s+\w+[- ]\w", "a name has no space or hyphen: write _ instead"),
    (r"^\s+\w+\s*\(self.*\):\s*$", "def is missing before the name of the method"),
    (r"\w\s+['\"]|['\"]\s+\w|['\"]\s*['\"]/", "a comma is missing, before or after the string"),
    (r"^\s*import\s+\w+\s+from\b", "the module comes first: from module import name"),
    (r"=\s*$", "a value is missing after the ="),
    (r"^\s*\w+\s*=\s*\+\+|\+\+\w", "in Python this is written += 1"),
)
#: A key that every notebook has, and how many lines of a file are searched for it.
_NOTEBOOK, _NOTEBOOK_LINES = re.compile(r'^\{\s*"(?:cells|metadata|nbformat)"\s*:|"cell_type"\s*:'), 200
_MAGIC = re.compile(r"^\s*(?:%{1,2}\w|!\w)")
#: Functions that start another program, of subprocess, asyncio and os.
_STARTERS = frozenset(
    {"Popen", "run", "call", "check_call", "check_output", "create_subprocess_exec"}
    | {f"{kind}{ending}" for kind in ("exec", "spawn") for ending in ("l", "le", "lp", "lpe", "v", "ve", "vp", "vpe")}
)
_MESSAGE_ENDINGS = ("_msgs", "_msg", "_interfaces", "_interface", "_srvs", "_srv", "_actions")


@crash_rule("", *FaultKind, in_file=False, priority=1010)
def _notebook(crash: Crash) -> Clue | None:
    """The text of a Jupyter notebook, or a command that only a notebook understands."""
    source, row = crash.case.source, crash.case.source.line(crash.line)
    if source.line(1)[:1] == "{" and _NOTEBOOK.search("\n".join(source.lines[:_NOTEBOOK_LINES])):
        return Clue(f"this is a notebook in spite of its name: {EXPORT_NOTEBOOK}", Location(source.file, 1))
    if (crash.fault.kind is FaultKind.SYNTAX_ERROR and _MAGIC.match(row[:200])) or crash.said("'get_ipython'"):
        return Clue(f"{quote(row.strip(), 60)} is a notebook command, which Python does not know: remove it")
    return None


@crash_rule("", FaultKind.SYNTAX_ERROR, in_file=False, priority=1020)
def _syntax(crash: Crash) -> Clue | None:
    fault, row = crash.fault, crash.case.source.line(crash.line)
    known = _python_2(fault, row) or _newer_f_string(fault, row) or _other_language(fault, row) or _said(fault, row)
    return known or _shown_by_row(fault, row)


def _shown_by_row(fault: Fault, row: str) -> Clue | None:
    if not fault.said("invalid syntax|invalid non-decimal"):
        return None
    advice = next((advice for pattern, advice in _ROWS if re.search(pattern, row[:500])), None)
    return None if advice is None else Clue(f"{advice}: {quote(row, 60)}")


def _python_2(fault: Fault, row: str) -> Clue | None:
    if not fault.said("call to 'print'"):
        return None
    found = _PRINT.match(row[:200])
    shown = f"print({found['what'].strip()})" if found else "print(...)"
    return Clue(f"this is Python 2; in Python 3 print is a function: {quote(shown, 70)}", key="python_2")


def _newer_f_string(fault: Fault, row: str) -> Clue | None:
    if not fault.said("f-string") or fault.python is None or fault.python >= (3, 12):
        return None
    # a text in the braces, and the closing brace behind it: without one, it is the brace that is missing
    nested = re.search(r"""[fF](['"])[^'"]*\{[^}'"]*\1[^'"{}]*\1[^'"{}]*\}""", row[:500])
    if nested is None:
        return None
    other = '"' if nested[1] == "'" else "'"
    hint = f"Python 3.{fault.python[1]}, which reads the file here, needs different quotes inside the braces"
    return Clue(f"{hint} than around them: use {other}")


def _other_language(fault: Fault, row: str) -> Clue | None:
    if not fault.said("invalid syntax|expected ':'"):
        return None
    if re.match(r"\s*else\s+(?!if\b|:)\S", row[:500]):
        return Clue(f"else has no condition: write else: alone, or elif with the condition: {quote(row, 60)}")
    right = next((word for pattern, word in _OPERATORS if re.search(pattern, row[:500])), None)
    return Clue(f"in Python this is written {right}: {quote(row, 60)}") if right else None


def _said(fault: Fault, row: str) -> Clue | None:
    if fault.said("Maybe you meant '=='") and re.match(r"\s*(?:if|elif|while)\b", row[:200]):
        return Clue("to compare, write == instead of =")
    known = ((found, template) for pattern, template in _SAYINGS if (found := fault.said(pattern)) is not None)
    found, template = next(known, (None, ""))
    if found is None or ("{code}" in template and not row.strip()):
        return None
    named = found[1] if found.re.groups else ""
    return Clue(template.format(code=quote(row, 60), indent=_indent(row), found=named))


def _indent(row: str) -> str:
    blank = row[: len(row) - len(row.lstrip())]
    tabs, spaces = blank.count("\t"), blank.count(" ")
    parts = [f"{n} {word}{'s' if n != 1 else ''}" for n, word in ((tabs, "tab"), (spaces, "space")) if n]
    return " and ".join(parts) or "no space"


@crash_rule("encoding|codec can't decode", FaultKind.SYNTAX_ERROR, in_file=False, priority=1030)
def _encoding(_: Crash) -> Clue | None:
    return Clue("save the file as UTF-8")


@crash_rule("null bytes", FaultKind.SYNTAX_ERROR, FaultKind.EXCEPTION, in_file=False, priority=1040)
def _null_bytes(_: Crash) -> Clue | None:
    return Clue("the file holds bytes that are not text: save it as UTF-8 in a text editor")


@crash_rule("^(?:ImportError|ModuleNotFoundError|AttributeError): .*", in_file=False, priority=1050)
def _hidden_module(crash: Crash) -> Clue | None:
    """A file of the submission hides the module that the error names."""
    case = crash.case
    hidden = [name for start in case.trace.starts if start.process == case.process for name in start.hidden]
    words = re.findall(r"'([\w.]+)'", crash.found[0])
    named = {word.partition(".")[0] for word in words}
    name = next((name for name in hidden if name.removesuffix(".py") in named), None)
    if name is None:
        return None
    return Clue(f"{name} has the name of a module and is imported instead: rename it")


@crash_rule("^ImportError: attempted relative import with no known parent package", in_file=False, priority=1060)
def _no_package(crash: Crash) -> Clue | None:
    source = crash.case.source
    written = next((n for n in source.all(ast.ImportFrom) if n.level and n.lineno == crash.line), None)
    if written is None or written.level > 1:
        advice = "relative imports work only in a package, and this file is not in one"
        return Clue(f"{advice}: hand in the whole package, with its setup.py and __init__.py")
    names = ", ".join(a.name + (f" as {a.asname}" if a.asname else "") for a in written.names)
    plain = f"from {written.module} import {names}" if written.module else f"import {names}"
    helper = (written.module or written.names[0].name).partition(".")[0]
    hint = f"the dot in '{source.code(written)}' works only in a package: write {quote(plain, 60)}"
    return Clue(f"{hint}, with {helper}.py in the same folder")


@crash_rule(r"No module named '([\w.]+)'", in_file=False, priority=1070)
def _ros_1(crash: Crash) -> Clue | None:
    module = crash.found[1].split(".")[0]
    if module not in ROS_1:
        return None
    hint = f"{module} belongs to ROS 1; this is ROS 2: use {ROS_1[module]}"
    if module == "rospy":
        attributes = crash.case.source.all(ast.Attribute)
        used = dict.fromkeys(last_name(n) for n in attributes if chain(n).startswith("rospy."))
        pairs = [f"rospy.{name} becomes {ROS_1_CALLS[name]}" for name in used if name in ROS_1_CALLS]
        hint += f"; {', '.join(pairs[:3])}" if pairs else ""
    return Clue(hint)


@crash_rule(r"^ModuleNotFoundError: No module named '([\w.]+)'", in_file=False, priority=1080)
def _missing_module(crash: Crash) -> Clue | None:
    wanted = crash.found[1][:80]
    called = named(wanted, 80)
    known = [*MODULES, *PACKAGES, *PLAIN_MODULES, "numpy"]
    near = closest(wanted, known, 0.8)
    if near and near.count(".") == wanted.count(".") and _has_alike_stem(wanted, near):
        return Clue(f"the module is called {near}, not {called}")
    if wanted.startswith("rclpy."):
        hint = f"there is no {called}; the class Node is in rclpy.node"
        return Clue(hint) if wanted.lower() == "rclpy.node" else None
    if wanted.endswith(_MESSAGE_ENDINGS) or _gives_messages(crash.case.source, wanted):
        listed = ", ".join(PACKAGES[:5])
        hint = f"the package {called} is not installed here: hand in its folder, grade with --interfaces"
        return Clue(f"{hint} FOLDER, or use messages from the standard packages: {listed}, ...")
    if "." in wanted:
        return None
    return Clue(f"{called} is neither in the submission nor installed here: hand it in, or do without it")


def _has_alike_stem(wanted: str, near: str) -> bool:
    """Return whether two names are alike without the ending that packages of messages share."""
    ending = next((one for one in _MESSAGE_ENDINGS if wanted.endswith(one) and near.endswith(one)), "")
    stems = [name.removesuffix(ending) for name in (wanted, near)]
    return not ending or closest(stems[0], stems[1:], 0.75) != ""


def _gives_messages(source: Source, module: str) -> bool:
    suffixes = tuple(f"{module}.{kind}" for kind in ("msg", "srv", "action"))
    return any(n.module in suffixes for n in source.all(ast.ImportFrom))


@crash_rule(
    r"^ImportError: cannot import name '(\w+)' from (partially initialized module )?'([\w.]+)'",
    in_file=False,
    priority=1090,
)
def _cannot_import(crash: Crash) -> Clue | None:
    name, partially, module = crash.found.groups()
    if partially:
        hint = f"{named(module, 60)} is only partly imported at this point: two files import each other"
        return Clue(f"{hint}, or one of your files has the name of a module")
    near = closest(name, MODULES.get(module, ()), 0.7)
    begun = [n for n in MODULES.get(module, ()) if n.rstrip("0123456789") == name]
    if begun:
        return Clue(f"there is no {name} in {module}: there are {' and '.join(begun)}")
    same = [n for n in MODULES.get(module, ()) if n.lower() == name.lower()]
    if same:
        return Clue(f"upper and lower case matter: from {module} import {same[0]}")
    right = import_of(name)
    if right and not right.startswith(f"from {module} "):
        return Clue(f"{name} is in another module: {right}")
    return Clue(f"from {module} import {near}, not {name}") if near else None


@crash_rule(r"^FileNotFoundError: \[Errno 2\] No such file or directory: '([^']+)'", in_file=False, priority=1100)
def _missing_file(crash: Crash) -> Clue | None:
    path, source = crash.found[1], crash.source
    name = named(path, 60)
    if any(last_name(n.func) in _STARTERS and covers(n, crash.line) for n in source.all(ast.Call)):
        return Clue(f"the program {name} is not installed where submissions run: do without it")
    if any(_writes(call) for call in source.on_line(crash.line, ast.Call)):
        hint = f"there is no folder for {name}: create it with os.makedirs(..., exist_ok=True)"
        return Clue(f"{hint}, or write to the folder that the program runs in")
    if path.startswith("/"):
        return Clue(f"{name} exists only on your computer: hand the file in with the program, and open it by its name")
    ways = {start.way for start in crash.case.trace.starts if start.process == crash.case.process}
    if ways - {StartWay.SCRIPT}:
        hint = f"`ros2 run` starts a program in any folder: let setup.py install {name} with data_files"
        return Clue(f"{hint}, and open it in the folder that get_package_share_directory returns")
    return Clue(f"{name} is not in the submission: hand it in, in the folder of the program")


def _writes(call: ast.Call) -> bool:
    """Return whether a call creates a file."""
    if last_name(call.func) != "open":
        return last_name(call.func) in ("write_text", "write_bytes")
    place = 1 if isinstance(call.func, ast.Name) else 0
    mode = literal_text(argument(call, place, "mode")) or ""
    return bool(set(mode) & set("wax")) and set(mode) <= set("waxbt+")


@crash_rule(r"partially initialized module '(\w+)' has no attribute", in_file=False, priority=1110)
def _shadowed_module(crash: Crash) -> Clue | None:
    module = named(crash.found[1], 60)
    return Clue(f"one of your files has the name of the module {module} and is imported instead: rename it")
