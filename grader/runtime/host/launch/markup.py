"""Launch files in XML and YAML: what one describes, as the same actions that a launch file in Python makes."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from .actions import ACTIONS
from .conditions import IfCondition, UnlessCondition
from .context import Context, Substitution, word_for
from .entities import Action, LaunchDescription
from .files import IncludeLaunchDescription
from .handlers import EVENT_ACTIONS
from .nodes import ROS_ACTIONS, ExecuteProcess, Node
from .parameters import ParameterFile, ParameterValue
from .places import folders_with_places
from .substitutions import ROS_SUBSTITUTIONS, SUBSTITUTIONS
from .unknown import Lacking

#: Limits of a file: real ones have some hundred elements, a few levels deep.
MOST_BYTES, MOST_ELEMENTS, DEEPEST_ELEMENT = 1 << 20, 10_000, 50
#: How deep substitutions may stand in each other.
DEEPEST_SUBSTITUTION = 20


class InvalidFrontendLaunchFileError(RuntimeError):
    """A launch file in XML or YAML that ROS refuses."""


class _Element:
    """An element of a file, with the line that it begins on; `read` says what was asked of it."""

    def __init__(self, tag: str, line: int, given: Mapping[str, Any], inner: list[_Element]) -> None:
        self.tag, self.line, self.given, self.inner = tag, line, given, inner

    def text(self, name: str) -> str | None:
        """Return an attribute as a text; None without it."""
        value = self.given.get(name)
        return None if value is None else word_for(value) if isinstance(value, bool) else str(value)

    def needed(self, name: str) -> str:
        """Return an attribute that must be there."""
        text = self.text(name)
        if text is None:
            raise AttributeError(f"<{self.tag}> needs the attribute '{name}'")
        return text

    def all(self, tag: str) -> list[_Element]:
        """Return the inner elements with a tag."""
        return [one for one in self.inner if one.tag == tag]

    def refuse_others(self, known: Sequence[str], inner: Sequence[str]) -> None:
        """Raise ValueError for an attribute or an inner element that has no meaning here."""
        names = [name for name in self.given if name.removesuffix("-sep") not in known]
        tags = [one.tag for one in self.inner if one.tag not in inner]
        if names or tags:
            what = f"the attribute '{names[0]}'" if names else f"<{tags[0]}>"
            raise ValueError(f"unexpected in <{self.tag}>: {what}")


def description_of(path: str, context: Context) -> LaunchDescription:
    """Return what a launch file in XML or YAML describes; what it raises has the place in the file."""
    source = context.shares.source_of(path)
    with open(path, "rb") as file:
        content = file.read(MOST_BYTES + 1)
    reader = _Reader(source)
    if len(content) > MOST_BYTES:
        reader.fail(1, InvalidFrontendLaunchFileError(f"expected at most {MOST_BYTES >> 20} MiB, found more"))
    read = _from_yaml if path.endswith((".yaml", ".yml")) else _from_xml
    try:
        root = read(content)
    except _AtLine as error:
        reader.fail(error.line, InvalidFrontendLaunchFileError(error.text))
    if root.tag != "launch":
        reader.fail(root.line, RuntimeError("Expected 'launch' as root tag"))
    return LaunchDescription(reader.actions(root.inner))


class _AtLine(Exception):  # noqa: N818  it carries a place, and ends as another error
    """Why a file cannot be read, and where."""

    def __init__(self, line: int, text: str) -> None:
        super().__init__(text)
        self.line, self.text = line, text


def _from_xml(content: bytes) -> _Element:
    """Read XML without entities, whose text may be of any length."""
    from xml.parsers import expat

    parser = expat.ParserCreate()
    top = _Element("", 0, {}, [])
    open_, count = [top], 0

    def begin(tag: str, given: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > MOST_ELEMENTS or len(open_) > DEEPEST_ELEMENT:
            raise _AtLine(parser.CurrentLineNumber, "too many elements, or too deep in each other")
        one = _Element(tag, parser.CurrentLineNumber, given, [])
        open_[-1].inner.append(one)
        open_.append(one)

    def end(_: str) -> None:
        open_.pop()

    def refuse(*_: object) -> None:
        raise _AtLine(parser.CurrentLineNumber, "entities are not read")

    parser.StartElementHandler, parser.EndElementHandler, parser.EntityDeclHandler = begin, end, refuse
    try:
        parser.Parse(content, True)  # noqa: FBT003  it takes no keyword
    except expat.ExpatError as error:
        raise _AtLine(error.lineno, f"not valid XML: {expat.ErrorString(error.code)}") from None
    except (ValueError, LookupError):  # an encoding that is not known
        raise _AtLine(1, "not valid XML: unknown encoding") from None
    return top.inner[0]


def _from_yaml(content: bytes) -> _Element:
    """Read YAML without anchors, whose values may be of any length."""
    import yaml  # comes with rclpy

    count = 0
    try:
        for event in yaml.parse(content):
            count += 1
            if isinstance(event, yaml.AliasEvent) or count > 4 * MOST_ELEMENTS:
                line = 1 if event.start_mark is None else event.start_mark.line + 1
                raise _AtLine(line, "anchors are not read, nor too many values")
        root = yaml.compose(content, yaml.SafeLoader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        text = getattr(error, "problem", None) or "it cannot be read"
        raise _AtLine(1 if mark is None else mark.line + 1, f"not valid YAML: {text}") from None
    except RecursionError:
        raise _AtLine(1, "too many values in each other") from None
    if not isinstance(root, yaml.MappingNode) or len(root.value) != 1:
        raise _AtLine(1, "expected `launch:` and a list of actions")
    tag, value = root.value[0]
    return _of_yaml(str(tag.value), tag.start_mark.line + 1, value, 1)


def _of_yaml(tag: str, line: int, node: Any, depth: int) -> _Element:
    import yaml

    if depth > DEEPEST_ELEMENT:
        raise _AtLine(line, "too many values in each other")
    given: dict[str, Any] = {}
    inner: list[_Element] = []
    pairs = node.value if isinstance(node, yaml.MappingNode) else []
    if isinstance(node, yaml.SequenceNode):  # actions, each with its type
        inner = _typed(node, depth)
    for key, value in pairs:
        name = str(key.value)
        if isinstance(value, yaml.SequenceNode) and name == "children":
            inner += _typed(value, depth)
        elif isinstance(value, yaml.SequenceNode) and all(isinstance(one, yaml.MappingNode) for one in value.value):
            inner += [_of_yaml(name, one.start_mark.line + 1, one, depth + 1) for one in value.value]
        elif isinstance(value, yaml.MappingNode):
            raise _AtLine(value.start_mark.line + 1, f"expected a value of `{name}`, found a mapping")
        else:
            given[name] = yaml.SafeLoader("").construct_object(value, deep=True)
    return _Element(tag, line, given, inner)


def _typed(node: Any, depth: int) -> list[_Element]:
    import yaml

    found = []
    for one in node.value:
        if not isinstance(one, yaml.MappingNode) or len(one.value) != 1:
            line = one.start_mark.line + 1
            raise _AtLine(line, "expected a mapping with one key, the type of the action")
        key, value = one.value[0]
        found.append(_of_yaml(str(key.value), key.start_mark.line + 1, value, depth + 1))
    return found


class _Reader:
    """Makes actions of elements.

    Args:
        path: The file, for places.
    """

    def __init__(self, path: str) -> None:
        self._path = path
        within = next((folder for folder in folders_with_places() if path.startswith(folder)), "")
        self._file = os.path.relpath(path, within) if within else os.path.basename(path)

    def fail(self, line: int, error: Exception) -> Any:
        """Raise an error as code in this line of the file would."""
        # Faults name the innermost line of the submission that an exception went through.
        exec(compile("\n" * (line - 1) + "raise error", self._path, "exec"), {"error": error})  # noqa: S102

    def actions(self, elements: Sequence[_Element]) -> list[Any]:
        """Return the actions that elements describe."""
        return [self._action(one) for one in elements]

    def _action(self, element: _Element) -> Any:
        make = _TAGS.get(element.tag.replace("-", "_"))
        try:
            given = {name for name in _CONDITIONS if name in element.given}
            if len(given) > 1:
                raise RuntimeError("if and unless conditions can't be used simultaneously")
            condition: Any = None
            if given:
                (name,) = given
                condition = (IfCondition if name == "if" else UnlessCondition)(substituted(element.needed(name)))
            if make is None and element.tag not in _LACKING:
                raise RuntimeError(f"Unrecognized entity of the type: {element.tag}")
            made = Lacking("action", element.tag) if make is None else make(self, element)
        except (AttributeError, RuntimeError, TypeError, ValueError) as error:
            if error.__traceback__ is not None and _is_placed(error, self._path):
                raise
            self.fail(element.line, type(error)(str(error)))
        made.condition, made.file, made.line = condition, self._file, element.line
        return made


def _is_placed(error: BaseException, path: str) -> bool:
    step = error.__traceback__
    while step is not None:
        if step.tb_frame.f_code.co_filename == path:
            return True
        step = step.tb_next
    return False


_CONDITIONS = ("if", "unless")


def _node(_: _Reader, element: _Element) -> Action:
    known = ("pkg", "exec", "name", "node-name", "exec_name", "namespace", "args", "ros_args", *_OF_PROCESS)
    element.refuse_others((*known, *_CONDITIONS), ("param", "remap", "env"))
    name, namespace = element.text("name"), element.text("namespace")
    more = _at_end(element)
    more |= {"prefix": True} if element.text("launch-prefix") else {}
    more |= {"env": True} if element.all("env") else {}
    return Node(
        package=substituted(element.needed("pkg")),
        executable=substituted(element.needed("exec")),
        name=None if name is None else substituted(name),
        namespace=None if namespace is None else substituted(namespace),
        parameters=[_parameter(one) for one in element.all("param")],
        remappings=[(substituted(one.needed("from")), substituted(one.needed("to"))) for one in element.all("remap")],
        arguments=_words(element.text("args")),
        ros_arguments=_words(element.text("ros_args")),
        **more,
    )


def _at_end(element: _Element) -> dict[str, Any]:
    """Return what is done when a program has ended, as the arguments of its action."""
    more: dict[str, Any] = {}
    if (respawn := element.text("respawn")) is not None:
        more["respawn"] = substituted(respawn)
    if (delay_s := element.text("respawn_delay")) is not None:
        more["respawn_delay"] = float(delay_s)
        if not more["respawn_delay"] >= 0:
            raise ValueError(f"respawn_delay: expected a number of seconds from 0, found {delay_s}")
    if (most := element.text("respawn_max_retries")) is not None:
        more["respawn_max_retries"] = int(most)
    if (on_exit := element.text("on_exit")) is not None:
        if on_exit != "shutdown":
            raise ValueError(f"on_exit: expected shutdown, found {on_exit}")
        more["on_exit"] = [EVENT_ACTIONS["Shutdown"]()]
    return more


#: Attributes of programs that change nothing for what a node does, those for its end, and one that is left out.
_OF_PROCESS = (
    *("output", "output_format", "emulate_tty", "cwd", "shell", "sigterm_timeout", "sigkill_timeout", "cached_output"),
    *("log_cmd", "respawn", "respawn_delay", "respawn_max_retries", "on_exit", "launch-prefix"),
)


def _parameter(element: _Element) -> Any:
    element.refuse_others(("name", "value", "type", "from", "allow_substs"), ("param",))
    if "from" in element.given:
        return ParameterFile(substituted(element.needed("from")))
    name = element.text("name")
    if name is None:
        raise ValueError("param Entity should have name or from attribute")
    if "value" not in element.given:
        if not element.inner:
            raise RuntimeError("either a value attribute or nested params are needed")
        inner: dict[Any, Any] = {}
        for one in element.inner:
            inner |= _parameter(one)
        return {tuple(substituted(name)): inner}
    if element.inner:
        raise RuntimeError("nested parameters and value attributes are mutually exclusive")
    return {tuple(substituted(name)): _value(element)}


def _value(element: _Element) -> Any:
    """Return the value of a parameter: XML writes all as text, which is read as YAML unless a type is given."""
    value, kind = element.given["value"], element.text("type")
    separator = element.text("value-sep")
    if separator and isinstance(value, str):
        value = value.split(separator)
    if isinstance(value, list):
        of_item = (kind or "").removeprefix("list_of_").removesuffix("s") or None
        items = [_scalar(one, of_item) for one in value]
        # Texts and substitutions in a list would be parts of one text, as in Python.
        return [one if isinstance(one, ParameterValue) else ParameterValue(one) for one in items]
    return _scalar(value, kind)


def _scalar(value: Any, kind: str | None) -> Any:
    if not isinstance(value, str):
        return value
    parts = substituted(value)
    if any(not isinstance(part, _Text) for part in parts):
        types = {"str": str, "int": int, "float": float, "bool": bool}
        return ParameterValue(_Joined(parts), value_type=types.get(kind)) if kind else _Joined(parts)
    text = "".join(part.fixed for part in parts)
    if kind == "str" or not text:
        return text
    import yaml

    try:
        found = yaml.safe_load(text)
    except yaml.YAMLError:
        return text
    if kind in ("int", "float"):
        return {"int": int, "float": float}[kind](text)
    return found if isinstance(found, (str, bool, int, float, list)) else text


def _group(reader: _Reader, element: _Element) -> Action:
    element.refuse_others(("scoped", "forwarding", *_CONDITIONS), tuple(one.tag for one in element.inner))
    values = {tuple(substituted(one.needed("name"))): substituted(one.needed("value")) for one in element.all("keep")}
    scoped = (element.text("scoped") or "true").casefold() in ("true", "1")
    actions = reader.actions([one for one in element.inner if one.tag != "keep"])
    made: Action = ACTIONS["GroupAction"](actions, scoped=scoped, launch_configurations=values)
    return made


def _include(_: _Reader, element: _Element) -> Action:
    element.refuse_others(("file", *_CONDITIONS), ("arg", "let"))
    given = [
        (substituted(one.needed("name")), substituted(one.needed("value")))
        for one in (*element.all("let"), *element.all("arg"))
    ]
    return IncludeLaunchDescription(substituted(element.needed("file")), launch_arguments=given)


def _argument(_: _Reader, element: _Element) -> Action:
    element.refuse_others(("name", "default", "description", *_CONDITIONS), ("choice",))
    default = element.text("default")
    made: Action = ACTIONS["DeclareLaunchArgument"](
        _unescaped(element.needed("name")),
        default_value=None if default is None else substituted(default),
        choices=[_unescaped(one.needed("value")) for one in element.all("choice")] or None,
    )
    return made


def _timer(reader: _Reader, element: _Element) -> Action:
    element.refuse_others(("period", *_CONDITIONS), tuple(one.tag for one in element.inner))
    made: Action = ACTIONS["TimerAction"](
        period=substituted(element.needed("period")), actions=reader.actions(element.inner)
    )
    return made


def _executable(_: _Reader, element: _Element) -> Action:
    element.refuse_others(("cmd", "name", *_OF_PROCESS, *_CONDITIONS), ("env",))
    return ExecuteProcess(cmd=_words(element.needed("cmd")), **_at_end(element))


def _shutdown(_: _Reader, element: _Element) -> Action:
    element.refuse_others(("reason", *_CONDITIONS), ())
    made: Action = EVENT_ACTIONS["Shutdown"](reason=element.text("reason") or "")
    return made


def _setting(kind: Callable[..., Action], *names: str) -> Callable[[_Reader, _Element], Action]:
    def make(_: _Reader, element: _Element) -> Action:
        element.refuse_others((*names, *_CONDITIONS), ())
        return kind(*(substituted(element.needed(name)) for name in names))

    return make


def _log_info(_: _Reader, element: _Element) -> Action:
    element.refuse_others(("message", *_CONDITIONS), ())
    made: Action = ACTIONS["LogInfo"](msg=substituted(element.needed("message")))
    return made


def _set_parameter(_: _Reader, element: _Element) -> Action:
    element.refuse_others(("name", "value", "type", *_CONDITIONS), ())
    made: Action = ROS_ACTIONS["SetParameter"](element.needed("name"), _value(element))
    return made


def _set_use_sim_time(_: _Reader, element: _Element) -> Action:
    element.refuse_others(("value", *_CONDITIONS), ())
    made: Action = ROS_ACTIONS["SetUseSimTime"](element.needed("value").casefold() in ("true", "1"))
    return made


#: What makes the action of an element, by its tag with underscores.
_TAGS: Mapping[str, Callable[[_Reader, _Element], Action]] = {
    "arg": _argument,
    "executable": _executable,
    "group": _group,
    "include": _include,
    "let": _setting(ACTIONS["SetLaunchConfiguration"], "name", "value"),
    "log": _log_info,
    "node": _node,
    "push_ros_namespace": _setting(ROS_ACTIONS["PushRosNamespace"], "namespace"),
    "ros_timer": _timer,
    "set_env": _setting(ACTIONS["SetEnvironmentVariable"], "name", "value"),
    "set_parameter": _set_parameter,
    "set_parameters_from_file": _setting(ROS_ACTIONS["SetParametersFromFile"], "filename"),
    "set_remap": _setting(ROS_ACTIONS["SetRemap"], "from", "to"),
    "set_use_sim_time": _set_use_sim_time,
    "shutdown": _shutdown,
    "timer": _timer,
}
#: The tags of other actions: of ROS Jazzy itself, and of its packages for Gazebo.
_LACKING = frozenset(
    {
        *("append_env", "load_composable_node", "node_container", "reset", "reset_env", "set_ros_log_dir", "unset_env"),
        *("gz_server", "gz_spawn_model", "ros_gz_bridge", "ros_gz_sim", "ros_gz_spawn_model"),
    }
)


class _Text(Substitution):
    """A fixed text between substitutions."""

    def __init__(self, fixed: str) -> None:
        self.fixed = fixed

    def perform(self, context: Context) -> str:
        """Return the text."""
        return self.fixed


class _Joined(Substitution):
    """Several substitutions as one."""

    def __init__(self, parts: Sequence[Substitution]) -> None:
        self._parts = parts

    def perform(self, context: Context) -> str:
        """Return their texts behind each other."""
        return "".join(part.perform(context) for part in self._parts)


def _unescaped(text: str) -> str:
    return re.sub(r"\\(.)", r"\1", text)


def substituted(text: str) -> list[Any]:
    """Return the parts of a text: fixed ones, and what `$(NAME ARGUMENT...)` stands for."""
    return _Scanner(text).parts()


class _Scanner:
    """Reads a text with substitutions, by the grammar of `launch`."""

    def __init__(self, text: str, depth: int = 0) -> None:
        self._text, self._at, self._depth = text, 0, depth

    def parts(self) -> list[Any]:
        """Return the parts of the whole text."""
        found = list(self._until(""))
        return found or [_Text("")]

    def _until(self, ends: str) -> Iterator[Any]:
        """Yield parts up to one of some characters, which is left."""
        begin = self._at
        while self._at < len(self._text):
            here = self._text[self._at]
            if here in ends and here:
                break
            if here == "\\":
                self._at = min(self._at + 2, len(self._text))
            elif self._text.startswith("$(", self._at):
                if self._at > begin:
                    yield _Text(_unescaped(self._text[begin : self._at]))
                yield self._substitution()
                begin = self._at
            else:
                self._at += 1
        if self._at > begin:
            yield _Text(_unescaped(self._text[begin : self._at]))

    def _substitution(self) -> Any:
        self._depth += 1
        if self._depth > DEEPEST_SUBSTITUTION:
            raise RuntimeError("substitutions are too deep in each other")
        name = re.compile(r"[A-Za-z][A-Za-z0-9_-]*").match(self._text, self._at + 2)
        if name is None:
            raise RuntimeError(f"expected the name of a substitution in '{self._text[:80]}'")
        self._at = name.end()
        arguments: list[list[Any]] = []
        while self._text[self._at : self._at + 1] == " ":
            self._at += 1
            quote = self._text[self._at : self._at + 1]
            if quote in ("'", '"') and quote:
                self._at += 1
                arguments.append(list(self._until(quote)) or [_Text("")])
                self._at += 1
            else:
                arguments.append(list(self._until(" )")))
        if self._text[self._at : self._at + 1] != ")":
            raise RuntimeError(f"expected ) at the end of $({name[0]} ...) in '{self._text[:80]}'")
        self._at += 1
        self._depth -= 1
        return _made(name[0], arguments)


def _made(name: str, arguments: list[list[Any]]) -> Any:
    """Return the substitution of a name."""
    if name not in _SUBSTITUTIONS:
        raise RuntimeError(f"Unknown substitution: {name}")
    kind, least, most = _SUBSTITUTIONS[name]
    if not least <= len(arguments) <= most:
        raise TypeError(f"$({name} ...) expects {least if least == most else f'{least} to {most}'} arguments")
    return kind(*arguments)


def _variable(name: Any, default: Any = None) -> Any:
    return SUBSTITUTIONS["LaunchConfiguration"](name, default=default)


def _environment(name: Any, default: Any = None) -> Any:
    return SUBSTITUTIONS["EnvironmentVariable"](name, default_value=default)


#: What makes a substitution of its arguments, and how many it takes, by its name in files.
_SUBSTITUTIONS: Mapping[str, tuple[Callable[..., Any], int, int]] = {
    "all": (SUBSTITUTIONS["AllSubstitution"], 1, 20),
    "and": (SUBSTITUTIONS["AndSubstitution"], 2, 2),
    "anon": (SUBSTITUTIONS["AnonName"], 1, 1),
    "any": (SUBSTITUTIONS["AnySubstitution"], 1, 20),
    "command": (SUBSTITUTIONS["Command"], 1, 2),
    "dirname": (SUBSTITUTIONS["ThisLaunchFileDir"], 0, 0),
    "env": (_environment, 1, 2),
    "equals": (SUBSTITUTIONS["EqualsSubstitution"], 2, 2),
    "eval": (lambda *parts: SUBSTITUTIONS["PythonExpression"](_spaced(parts)), 1, 100),
    "exec-in-pkg": (ROS_SUBSTITUTIONS["ExecutableInPackage"], 2, 2),
    "file-content": (SUBSTITUTIONS["FileContent"], 1, 1),
    "filename": (SUBSTITUTIONS["ThisLaunchFile"], 0, 0),
    "find-exec": (lambda name: SUBSTITUTIONS["FindExecutable"](name=name), 1, 1),
    "find-pkg-prefix": (ROS_SUBSTITUTIONS["FindPackagePrefix"], 1, 1),
    "find-pkg-share": (ROS_SUBSTITUTIONS["FindPackageShare"], 1, 1),
    "if": (SUBSTITUTIONS["IfElseSubstitution"], 2, 3),
    "launch_log_dir": (SUBSTITUTIONS["LaunchLogDir"], 0, 0),
    "log_dir": (SUBSTITUTIONS["LaunchLogDir"], 0, 0),
    "not": (SUBSTITUTIONS["NotSubstitution"], 1, 1),
    "not-equals": (SUBSTITUTIONS["NotEqualsSubstitution"], 2, 2),
    "or": (SUBSTITUTIONS["OrSubstitution"], 2, 2),
    "param": (ROS_SUBSTITUTIONS["Parameter"], 1, 1),
    "var": (_variable, 1, 2),
}


def _spaced(parts: Sequence[Any]) -> list[Any]:
    """Return arguments that stood apart as one list, with spaces between them."""
    joined: list[Any] = []
    for part in parts:
        joined += [*([_Text(" ")] if joined else []), *part]
    return joined


def _words(text: str | None) -> list[Any]:
    """Return the words of a command line, each as its parts; a space between substitutions ends a word."""
    words: list[list[Any]] = []
    open_ = False
    for part in [] if text is None else substituted(text):
        if not isinstance(part, _Text):
            words = words if open_ else [*words, []]
            words[-1].append(part)
            open_ = True
            continue
        tokens = shlex.split(part.fixed)
        if part.fixed[:1].isspace():
            open_ = False
        for token in tokens:
            words = words if open_ else [*words, []]
            words[-1].append(_Text(token))
            open_ = False
        open_ = bool(tokens) and not part.fixed[-1:].isspace()
    return words
