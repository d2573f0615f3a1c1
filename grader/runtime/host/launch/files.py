"""Launch files: what one describes, and the action that includes another one."""

from __future__ import annotations

import os
from collections.abc import Iterable
from types import ModuleType
from typing import Any

from .context import Context, text_of
from .entities import Action, LaunchDescription, walk
from .left_out import LeftOutError
from .unknown import pairs_of

#: Endings of launch files that are not in Python.
MARKUP = (".xml", ".yaml", ".yml", ".launch")
#: The deepest nesting of included launch files.
DEEPEST = 20


class PythonLaunchDescriptionSource:
    """A launch file by its path."""

    def __init__(self, launch_file_path: Any, **_: Any) -> None:
        self.path = launch_file_path


def launch_source(name: str) -> type[PythonLaunchDescriptionSource]:
    """Return a source of this name, whose file may be of any kind."""
    return type(name, (PythonLaunchDescriptionSource,), {"__doc__": f"The source {name}."})


#: The sources that `launch` has, by name.
SOURCES = {
    "PythonLaunchDescriptionSource": PythonLaunchDescriptionSource,
    **{name: launch_source(name) for name in ("AnyLaunchDescriptionSource", "FrontendLaunchDescriptionSource")},
}


class IncludeLaunchDescription(Action):
    """Another launch file, with arguments."""

    def __init__(self, launch_description_source: Any, *, launch_arguments: Any = None, **more: Any) -> None:
        super().__init__(**more)
        self.source, self.given = launch_description_source, () if launch_arguments is None else launch_arguments

    def execute(self, context: Context) -> Iterable[Any]:
        """Set the arguments and visit what the file describes."""
        for name, value in pairs_of(self.given, "launch_arguments"):
            context.launch_configurations[text_of(name, context)] = text_of(value, context)
        if isinstance(self.source, LaunchDescription):
            return self.source.entities
        path = context.shares.found(text_of(getattr(self.source, "path", self.source), context))
        if not path.endswith((".py", *MARKUP)):
            raise LeftOutError("launch_file", os.path.basename(path))
        if len(context.files) >= DEEPEST:
            raise RecursionError(f"launch files include each other more than {DEEPEST} times")
        context.files.append(path)
        walk(description_in(path, context).entities, context)
        context.files.pop()
        return ()


def description_in(path: str, context: Context) -> LaunchDescription:
    """Return what a launch file describes: in Python, what its `generate_launch_description` returns."""
    if path.endswith(MARKUP) and context.read_markup is not None:
        found: LaunchDescription = context.read_markup(path, context)
        return found
    with open(path, "rb") as source:
        # In a share folder lies a copy: the places are those in the submission.
        code = compile(source.read(), context.shares.source_of(path), "exec", dont_inherit=True)
    module = ModuleType("launch_file")
    module.__file__ = path
    exec(code, module.__dict__)  # noqa: S102  evaluating the student's file is the purpose
    make = getattr(module, "generate_launch_description", None)
    if not callable(make):
        raise AttributeError(f"{os.path.basename(path)} has no function generate_launch_description()")
    made = make()
    if not isinstance(made, LaunchDescription):
        raise TypeError(f"generate_launch_description() returned {type(made).__name__}, expected a LaunchDescription")
    return made
