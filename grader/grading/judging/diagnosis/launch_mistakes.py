"""Explains misspelt and misplaced names of ROS's launch packages."""

from __future__ import annotations

import ast
from collections.abc import Mapping

from grader.grading.judging.diagnosis.names import closest, import_of
from grader.grading.judging.diagnosis.rules import Clue, Crash, crash_rule
from grader.grading.judging.source import last_name

#: The public classes and functions that launch files use, by the module that they are imported from.
NAMES: Mapping[str, str] = {
    "launch": (
        "Action Condition Event EventHandler InvalidLaunchFileError LaunchContext LaunchDescription "
        "LaunchDescriptionEntity LaunchDescriptionSource LaunchIntrospector LaunchService Substitution"
    ),
    "launch.actions": (
        "AppendEnvironmentVariable DeclareLaunchArgument EmitEvent ExecuteLocal ExecuteProcess GroupAction "
        "IncludeLaunchDescription LogInfo OpaqueCoroutine OpaqueFunction PopEnvironment PopLaunchConfigurations "
        "PushEnvironment PushLaunchConfigurations RegisterEventHandler ResetEnvironment ResetLaunchConfigurations "
        "SetEnvironmentVariable SetLaunchConfiguration Shutdown TimerAction UnregisterEventHandler "
        "UnsetEnvironmentVariable UnsetLaunchConfiguration"
    ),
    "launch.substitutions": (
        "AllSubstitution AndSubstitution AnonName AnySubstitution Command EnvironmentVariable EqualsSubstitution "
        "FileContent FindExecutable IfElseSubstitution LaunchConfiguration LaunchLogDir LocalSubstitution "
        "NotEqualsSubstitution NotSubstitution OrSubstitution PathJoinSubstitution PythonExpression "
        "TextSubstitution ThisLaunchFile ThisLaunchFileDir"
    ),
    "launch.conditions": ("IfCondition LaunchConfigurationEquals LaunchConfigurationNotEquals UnlessCondition"),
    "launch.event_handlers": (
        "OnExecutionComplete OnIncludeLaunchDescription OnProcessExit OnProcessIO OnProcessStart OnShutdown"
    ),
    "launch.events": "ExecutionComplete IncludeLaunchDescription Shutdown TimerEvent",
    "launch.launch_description_sources": (
        "AnyLaunchDescriptionSource FrontendLaunchDescriptionSource InvalidFrontendLaunchFileError "
        "InvalidLaunchFileError InvalidPythonLaunchFileError PythonLaunchDescriptionSource"
    ),
    "launch_ros.actions": (
        "ComposableNodeContainer LifecycleNode LifecycleTransition LoadComposableNodes Node PushROSNamespace "
        "PushRosNamespace ROSTimer RosTimer SetParameter SetParametersFromFile SetROSLogDir SetRemap SetUseSimTime"
    ),
    "launch_ros.substitutions": ("ExecutableInPackage FindPackage FindPackagePrefix FindPackageShare Parameter"),
    "launch_ros.parameter_descriptions": "Parameter ParameterFile ParameterValue",
    "launch_ros.descriptions": "ComposableNode Parameter ParameterFile ParameterValue",
    "launch_ros.event_handlers": "OnStateTransition",
    "ament_index_python.packages": (
        "PackageNotFoundError get_package_prefix get_package_share_directory get_package_share_path "
        "get_packages_with_prefixes get_resource get_resources get_search_paths"
    ),
}
_OF_PROCESSES = (
    "prefix cwd env additional_env shell sigterm_timeout sigkill_timeout emulate_tty output output_format "
    "cached_output log_cmd on_exit respawn respawn_delay respawn_max_retries condition"
)
_OF_NODES = "name namespace executable package exec_name parameters remappings ros_arguments arguments " + _OF_PROCESSES
#: What the constructors of some of them take.
TAKES: Mapping[str, str] = {
    "Node": _OF_NODES,
    "LifecycleNode": _OF_NODES,
    "ComposableNodeContainer": f"composable_node_descriptions {_OF_NODES}",
    "ExecuteProcess": f"cmd name {_OF_PROCESSES}",
    "DeclareLaunchArgument": "name default_value description choices condition",
    "IncludeLaunchDescription": "launch_description_source launch_arguments condition",
    "TimerAction": "period actions cancel_on_shutdown condition",
    "GroupAction": "actions scoped forwarding launch_configurations condition",
    "RegisterEventHandler": "event_handler condition",
    "OnProcessExit": "on_exit target_action handle_once",
    "OnProcessStart": "on_start target_action handle_once",
}

_ROS = r"(?:launch|launch_ros|ament_index_python)"


def _import_of(name: str) -> str:
    """Return the statement that imports a name of the launch packages; empty if they have none."""
    home = next((module for module, names in NAMES.items() if name in names.split()), "")
    return f"from {home} import {name}" if home else ""


@crash_rule(rf"^ImportError: cannot import name '(\w+)' from '({_ROS}(?:\.[\w.]+)?)'", in_file=False, priority=1062)
def _launch_import(crash: Crash) -> Clue | None:
    """A name that a launch package does not have, or that is in another module of it."""
    name, module = crash.found.groups()
    if right := _import_of(name) or import_of(name):
        return Clue(f"{name} is in another module: {right}")
    if near := closest(name, NAMES.get(module, "").split(), 0.7):
        return Clue(f"from {module} import {near}, not {name}")
    anywhere = closest(name, " ".join(NAMES.values()).split(), 0.8)
    return Clue(f"there is no {name}: {_import_of(anywhere)}") if anywhere else None


@crash_rule(rf"^AttributeError: module '({_ROS}(?:\.[\w.]+)?)' has no attribute '(\w+)'", in_file=False, priority=1064)
def _launch_attribute(crash: Crash) -> Clue | None:
    """The same, of a module."""
    module, name = crash.found.groups()
    if right := _import_of(name):
        return Clue(f"{name} is in another module: {right}")
    parts = [other.removeprefix(f"{module}.") for other in NAMES if other.startswith(f"{module}.")]
    near = closest(name, [*NAMES.get(module, "").split(), *parts], 0.7)
    return Clue(f"{module}.{name} should be {module}.{near}") if near else None


@crash_rule(rf"^ModuleNotFoundError: No module named '({_ROS}\.[\w.]+)'", in_file=False, priority=1066)
def _launch_module(crash: Crash) -> Clue | None:
    """A misspelt module of a launch package."""
    near = closest(crash.found[1], NAMES, 0.8)
    return Clue(f"the module is called {near}, not {crash.found[1]}") if near else None


@crash_rule(r"^NameError: name '(\w+)' is not defined", in_file=False, priority=2005)
def _launch_name(crash: Crash) -> Clue | None:
    """A name of the launch packages that a launch file has not imported, or misspells."""
    name, aliases = crash.found[1], crash.source.aliases
    if not (crash.fault.process.endswith(".launch.py") or crash.source.functions("generate_launch_description")):
        return None
    if near := closest(name, [one for one, whole in aliases.items() if whole.startswith("launch")], 0.7):
        return Clue(f"{name} should be {near}")
    if right := _import_of(name):
        return Clue(f"the import is missing: {right}")
    anywhere = closest(name, " ".join(NAMES.values()).split(), 0.8)
    return Clue(f"{name} should be {anywhere}: {_import_of(anywhere)}") if anywhere else None


@crash_rule(
    r"^TypeError: (\w+)\.__init__\(\) (?:got an unexpected keyword argument|missing a required argument:) '(\w+)'",
    in_file=False,
    priority=1068,
)
def _launch_argument(crash: Crash) -> Clue | None:
    """A misspelt argument of what a launch file describes."""
    called, name = crash.found.groups()
    known = TAKES.get(called, "").split()
    if name in known:  # it is missing, because another one was meant to be it
        calls = [c for c in crash.source.all(ast.Call) if last_name(c.func) == called]
        given = [k.arg for c in calls for k in c.keywords if k.arg is not None and k.arg not in known]
        wrong = closest(name, given, 0.7)
        return (
            Clue(f"write {name}=, not {wrong}=") if wrong else Clue(f"give {called} its {name}: {called}({name}=...)")
        )
    near = closest(name, known, 0.7)
    return Clue(f"write {near}=, not {name}=") if near else None
