"""Puts modules in place of `launch`, `launch_ros` and `ament_index_python`: which names each of them has."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

from . import actions, conditions, entities, files, handlers, nodes, parameters, ros_modules, ros_names, substitutions
from .context import Context, LaunchContext, Substitution, text_of
from .package_index import ament_index
from .unknown import Lacking, like_ros, stand_in_for


def _by_name(*kinds: type) -> dict[str, Any]:
    return {kind.__name__: kind for kind in kinds}


_DESCRIPTIONS = _by_name(parameters.ParameterValue, parameters.ParameterFile, parameters.Parameter)
_SUBSTITUTION_TYPES = {
    "SomeSubstitutionsType": Any,
    "SomeSubstitutionsType_types_tuple": (str, Substitution, list, tuple),
}


def _listed(parts: Any) -> list[Any]:
    return list(parts) if isinstance(parts, (list, tuple)) else [parts]


#: What is evaluated, by the modules of ROS that have it.
MODULES: dict[str, dict[str, Any]] = {
    "launch": {
        **_by_name(entities.LaunchDescription, LaunchContext, entities.LaunchDescriptionEntity),
        **_by_name(entities.Action, Substitution),
        **_SUBSTITUTION_TYPES,
    },
    "launch.actions": {
        **actions.ACTIONS,
        **handlers.EVENT_ACTIONS,
        **_by_name(entities.Action, nodes.ExecuteProcess, files.IncludeLaunchDescription),
    },
    "launch.conditions": _by_name(
        conditions.IfCondition,
        conditions.UnlessCondition,
        conditions.LaunchConfigurationEquals,
        conditions.LaunchConfigurationNotEquals,
    ),
    "launch.event_handlers": _by_name(
        handlers.OnProcessStart,
        handlers.OnProcessExit,
        handlers.OnExecutionComplete,
        handlers.OnProcessIO,
        handlers.OnShutdown,
    ),
    "launch.events": handlers.EVENTS,
    "launch.launch_description_sources": dict(files.SOURCES),
    "launch.substitutions": substitutions.SUBSTITUTIONS,
    "launch.logging": {"get_logger": logging.getLogger},
    "launch.some_substitutions_type": _SUBSTITUTION_TYPES,
    "launch.utilities": {
        "perform_substitutions": lambda context, parts: text_of(parts, context),
        "normalize_to_list_of_substitutions": _listed,
    },
    "launch_ros.actions": nodes.ROS_ACTIONS,
    "launch_ros.descriptions": _DESCRIPTIONS,
    "launch_ros.parameter_descriptions": _DESCRIPTIONS,
    "launch_ros.substitutions": substitutions.ROS_SUBSTITUTIONS,
    "launch_xml.launch_description_sources": _by_name(files.launch_source("XMLLaunchDescriptionSource")),
    "launch_yaml.launch_description_sources": _by_name(files.launch_source("YAMLLaunchDescriptionSource")),
}


#: The classes among them, by their keys in `ros_classes`.
_CLASSES = {
    ros_names.key_of(module, name): found
    for module, members in MODULES.items()
    for name, found in members.items()
    if isinstance(found, type)
}


for _key, _kind in _CLASSES.items():
    # Those of this package; some names stand for classes of Python.
    if _kind.__module__.startswith(f"{__package__}."):
        like_ros(_kind, _key)


_PACKAGES = frozenset(name.partition(".")[0] for name in MODULES)


#: Packages that launch files import and that are not here: what they make is left out where it is used.
_ABSENT = (
    "controller_manager",
    "launch_pal",
    "launch_param_builder",
    "launch_pytest",
    "launch_testing",
    "launch_testing_ament_cmake",
    "launch_testing_ros",
    "moveit_configs_utils",
    "nav2_common",
    "ros_gz_bridge",
    "ros_gz_sim",
    "simple_launch",
    "tracetools_launch",
    "webots_ros2_driver",
    "xacro",
)


def install(context: Context) -> None:
    """Put the modules in place of `launch`, `launch_ros` and `ament_index_python`."""
    index = ament_index(context)
    for name in {**ros_modules.MODULES, **MODULES}:
        module = sys.modules[name] = ModuleType(name)
        module.__path__ = []
        module.__dict__.update(MODULES.get(name, {}))
        module.__dict__["__getattr__"] = _of_ros(module)
        if name.startswith("ament_index_python"):
            names = ros_modules.MODULES[name].split()
            module.__dict__.update({one: found for one, found in index.items() if one in names})
    for name in (*ros_modules.MODULES, *MODULES):
        above, _, last = name.rpartition(".")
        if above:
            setattr(sys.modules[above], last, sys.modules[name])
    sys.meta_path.append(_Unavailable())


class _Unavailable:
    """Finds the packages that are not here, and modules of launch that only a newer ROS may have."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """Return what loads a module; None for one of others."""
        package = name.partition(".")[0]
        newer = package in _PACKAGES and not ros_names.knows_release()
        return ModuleSpec(name, self, is_package=True) if newer or package in _ABSENT else None  # type: ignore[arg-type]

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return a module whose names are made when they are asked for."""
        module, package = ModuleType(spec.name), spec.name.partition(".")[0]
        module.__dict__["__getattr__"] = _absent(package) if package in _ABSENT else _of_ros(module)
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Do nothing: there is no code."""


def _absent(package: str) -> Callable[[str], Any]:
    def find(name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return Lacking("module", package)

    return find


def _of_ros(module: ModuleType) -> Callable[[str], Any]:
    """Return what finds a name of a module of ROS: what is evaluated, or what stands for it; others do not exist."""

    def find(name: str) -> Any:
        where = module.__name__
        known = ros_names.has(where, name) or not (ros_names.knows_release() or name.startswith("_"))
        if not known:
            raise AttributeError(f"module '{where}' has no attribute '{name}'")
        found = _CLASSES.get(ros_names.key_of(where, name)) or stand_in_for(where, name)
        setattr(module, name, found)
        return found

    return find
