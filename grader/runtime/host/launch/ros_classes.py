"""The classes of ROS's own `launch` packages: which names the constructor of each takes, and which each class has.

Names only, read from the branches `jazzy` of ros2/launch (09403fc, after 3.4.3), ros2/launch_ros (62c56e5, after
0.26.6) and ament/ament_index (0a35ca6, after 1.8.1), of December 2024.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class NameKind(NamedTuple):
    """A class of ROS: the names that it takes and has."""

    base: str  # the class that it is derived from, as a key of `CLASSES`; empty for one of other packages
    takes: str  # its constructor's parameters, with `=` behind those that have defaults; `**` for unknown ones
    has: str  # its own methods and attributes


#: Classes by their name; by the package in front of it where two have the same.
CLASSES: Mapping[str, NameKind] = {
    "Action": NameKind(
        "LaunchDescriptionEntity",
        "* condition=",
        "condition execute get_sub_entities parse",
    ),
    "AllSubstitution": NameKind(
        "Substitution",
        "*args",
        "args parse",
    ),
    "AndSubstitution": NameKind(
        "Substitution",
        "left right",
        "left parse right",
    ),
    "AnonName": NameKind(
        "Substitution",
        "name",
        "compute_name name parse",
    ),
    "AnyLaunchDescriptionSource": NameKind(
        "LaunchDescriptionSource",
        "launch_file_path",
        "",
    ),
    "AnySubstitution": NameKind(
        "Substitution",
        "*args",
        "args parse",
    ),
    "AppendEnvironmentVariable": NameKind(
        "Action",
        "name value prepend= separator= * condition=",
        "name prepend separator value",
    ),
    "AsyncSafeSignalManager": NameKind(
        "",
        "loop",
        "handle",
    ),
    "BaseEventHandler": NameKind(
        "",
        "* matcher handle_once=",
        "describe handle handle_once handler_description matcher_description matches",
    ),
    "ChangeState": NameKind(
        "Event",
        "* lifecycle_node_matcher transition_id",
        "lifecycle_node_matcher transition_id valid_states valid_transitions",
    ),
    "Command": NameKind(
        "Substitution",
        "command * on_stderr=",
        "command on_stderr parse",
    ),
    "ComposableNode": NameKind(
        "",
        "* package plugin name= namespace= parameters= remappings= extra_arguments= condition=",
        "condition extra_arguments node_name node_namespace node_plugin package parameters parse remappings",
    ),
    "ComposableNodeContainer": NameKind(
        "Node",
        "* name namespace composable_node_descriptions= executable package= exec_name= parameters= remappings= "
        "ros_arguments= arguments= prefix= cwd= env= additional_env= shell= sigterm_timeout= sigkill_timeout= "
        "emulate_tty= output= output_format= cached_output= log_cmd= on_exit= respawn= respawn_delay= "
        "respawn_max_retries= condition=",
        "",
    ),
    "Condition": NameKind(
        "",
        "* predicate=",
        "describe evaluate",
    ),
    "DeclareLaunchArgument": NameKind(
        "Action",
        "name * default_value= description= choices= condition=",
        "choices default_value description name",
    ),
    "EmitEvent": NameKind(
        "Action",
        "* event condition=",
        "event",
    ),
    "EnvironmentVariable": NameKind(
        "Substitution",
        "name * default_value=",
        "default_value name parse",
    ),
    "EqualsSubstitution": NameKind(
        "Substitution",
        "left right",
        "left parse right",
    ),
    "Event": NameKind(
        "",
        "**",
        "name",
    ),
    "EventHandler": NameKind(
        "BaseEventHandler",
        "* matcher entities= handle_once=",
        "entities",
    ),
    "Executable": NameKind(
        "",
        "* cmd prefix= name= cwd= env= additional_env= arguments=",
        "additional_env arguments cmd cwd env final_cmd final_cwd final_env final_name name prefix prepare",
    ),
    "ExecutableInPackage": NameKind(
        "FindPackagePrefix",
        "executable package",
        "executable",
    ),
    "ExecuteLocal": NameKind(
        "Action",
        "* process_description shell= sigterm_timeout= sigkill_timeout= emulate_tty= output= output_format= "
        "cached_output= log_cmd= on_exit= respawn= respawn_delay= respawn_max_retries= condition=",
        "emulate_tty get_stderr get_stdout output prepare process_description process_details return_code shell "
        "sigkill_timeout sigterm_timeout",
    ),
    "ExecuteProcess": NameKind(
        "ExecuteLocal",
        "* cmd prefix= name= cwd= env= additional_env= shell= sigterm_timeout= sigkill_timeout= emulate_tty= "
        "output= output_format= cached_output= log_cmd= on_exit= respawn= respawn_delay= respawn_max_retries= "
        "condition=",
        "additional_env cmd cwd env name",
    ),
    "ExecutionComplete": NameKind(
        "Event",
        "* action",
        "action",
    ),
    "FileContent": NameKind(
        "Substitution",
        "path",
        "parse path",
    ),
    "FindExecutable": NameKind(
        "Substitution",
        "* name",
        "name parse",
    ),
    "FindPackage": NameKind(
        "Substitution",
        "package",
        "find package parse",
    ),
    "FindPackagePrefix": NameKind(
        "FindPackage",
        "package",
        "",
    ),
    "FindPackageShare": NameKind(
        "FindPackage",
        "package",
        "",
    ),
    "FrontendLaunchDescriptionSource": NameKind(
        "LaunchDescriptionSource",
        "launch_file_path * method= parser=",
        "",
    ),
    "GroupAction": NameKind(
        "Action",
        "actions * scoped= forwarding= launch_configurations= condition=",
        "",
    ),
    "IfCondition": NameKind(
        "Condition",
        "predicate_expression",
        "",
    ),
    "IfElseSubstitution": NameKind(
        "Substitution",
        "condition if_value= else_value=",
        "condition else_value if_value parse",
    ),
    "launch.actions.IncludeLaunchDescription": NameKind(
        "Action",
        "launch_description_source * launch_arguments= condition=",
        "launch_arguments launch_description_source",
    ),
    "launch.events.IncludeLaunchDescription": NameKind(
        "Event",
        "launch_description",
        "launch_description",
    ),
    "InvalidConditionExpressionError": NameKind(
        "",
        "expression unexpanded_expression valid_expressions",
        "",
    ),
    "InvalidFrontendLaunchFileError": NameKind(
        "InvalidLaunchFileError",
        "extension= * likely_errors=",
        "",
    ),
    "InvalidLaunchFileError": NameKind(
        "",
        "extension= * likely_errors=",
        "",
    ),
    "InvalidPythonLaunchFileError": NameKind(
        "",
        "**",
        "",
    ),
    "InvalidResourceNameError": NameKind(
        "",
        "**",
        "",
    ),
    "InvalidResourceTypeNameError": NameKind(
        "",
        "**",
        "",
    ),
    "LaunchConfig": NameKind(
        "",
        "",
        "file_formatter file_handlers get_log_file_handler get_log_file_path get_screen_handler level log_dir "
        "log_handler_factory reset screen_formatter screen_handler set_log_format set_screen_format",
    ),
    "LaunchConfiguration": NameKind(
        "Substitution",
        "variable_name * default=",
        "parse variable_name",
    ),
    "LaunchConfigurationEquals": NameKind(
        "Condition",
        "launch_configuration_name expected_value",
        "",
    ),
    "LaunchConfigurationNotEquals": NameKind(
        "LaunchConfigurationEquals",
        "launch_configuration_name expected_value",
        "",
    ),
    "LaunchContext": NameKind(
        "",
        "* argv= noninteractive=",
        "add_completion_future argv asyncio_loop emit_event emit_event_sync environment extend_globals "
        "extend_locals get_locals_as_dict is_shutdown launch_configurations locals noninteractive "
        "perform_substitution register_event_handler unregister_event_handler would_handle_event",
    ),
    "LaunchDescription": NameKind(
        "LaunchDescriptionEntity",
        "initial_entities= * deprecated_reason=",
        "add_action add_entity deprecated deprecated_reason entities get_launch_arguments "
        "get_launch_arguments_with_include_launch_description_actions",
    ),
    "LaunchDescriptionEntity": NameKind(
        "",
        "**",
        "describe describe_conditional_sub_entities describe_sub_entities get_asyncio_future visit",
    ),
    "LaunchDescriptionSource": NameKind(
        "",
        "launch_description= location= method=",
        "get_launch_description location method try_get_launch_description_without_context",
    ),
    "LaunchIntrospector": NameKind(
        "",
        "**",
        "format_launch_description",
    ),
    "LaunchLogDir": NameKind(
        "Substitution",
        "",
        "parse",
    ),
    "LaunchLogger": NameKind(
        "",
        "*args **kwargs",
        "all_loggers propagate",
    ),
    "LaunchService": NameKind(
        "",
        "* argv= noninteractive= debug=",
        "context emit_event event_loop include_launch_description run run_async shutdown task",
    ),
    "LifecycleNode": NameKind(
        "Node",
        "* name namespace executable package= exec_name= parameters= remappings= ros_arguments= arguments= prefix= "
        "cwd= env= additional_env= shell= sigterm_timeout= sigkill_timeout= emulate_tty= output= output_format= "
        "cached_output= log_cmd= on_exit= respawn= respawn_delay= respawn_max_retries= condition=",
        "",
    ),
    "LifecycleTransition": NameKind(
        "Action",
        "* lifecycle_node_names transition_ids condition=",
        "transition_targets",
    ),
    "LoadComposableNodes": NameKind(
        "Action",
        "* composable_node_descriptions target_container condition=",
        "",
    ),
    "LocalSubstitution": NameKind(
        "Substitution",
        "expression description=",
        "description expression",
    ),
    "LogInfo": NameKind(
        "Action",
        "* msg condition=",
        "msg",
    ),
    "Node": NameKind(
        "ExecuteProcess",
        "* executable package= name= namespace= exec_name= parameters= remappings= ros_arguments= arguments= "
        "prefix= cwd= env= additional_env= shell= sigterm_timeout= sigkill_timeout= emulate_tty= output= "
        "output_format= cached_output= log_cmd= on_exit= respawn= respawn_delay= respawn_max_retries= condition=",
        "UNSPECIFIED_NODE_NAME UNSPECIFIED_NODE_NAMESPACE expanded_node_namespace expanded_remapping_rules "
        "is_node_name_fully_specified node_executable node_name node_package parse_nested_parameters",
    ),
    "NodeActionExtension": NameKind(
        "",
        "",
        "EXTENSION_POINT_VERSION NAME prepare_for_execute",
    ),
    "NotEqualsSubstitution": NameKind(
        "EqualsSubstitution",
        "left right",
        "",
    ),
    "NotSubstitution": NameKind(
        "Substitution",
        "value",
        "parse value",
    ),
    "OnActionEventBase": NameKind(
        "BaseEventHandler",
        "* action_matcher on_event target_event_cls target_action_cls handle_once=",
        "",
    ),
    "OnExecutionComplete": NameKind(
        "OnActionEventBase",
        "* target_action= on_completion handle_once=",
        "",
    ),
    "OnIncludeLaunchDescription": NameKind(
        "EventHandler",
        "* handle_once=",
        "",
    ),
    "OnProcessExit": NameKind(
        "OnActionEventBase",
        "* target_action= on_exit handle_once=",
        "",
    ),
    "OnProcessIO": NameKind(
        "OnActionEventBase",
        "* target_action= on_stdin= on_stdout= on_stderr= handle_once=",
        "",
    ),
    "OnProcessStart": NameKind(
        "OnActionEventBase",
        "* target_action= on_start handle_once=",
        "",
    ),
    "OnShutdown": NameKind(
        "BaseEventHandler",
        "* on_shutdown handle_once=",
        "",
    ),
    "OnStateTransition": NameKind(
        "EventHandler",
        "* entities target_lifecycle_node= transition= start_state= goal_state= matcher= handle_once=",
        "",
    ),
    "OpaqueCoroutine": NameKind(
        "Action",
        "* coroutine args= kwargs= ignore_context= condition=",
        "",
    ),
    "OpaqueFunction": NameKind(
        "Action",
        "* function args= kwargs= condition=",
        "",
    ),
    "OrSubstitution": NameKind(
        "Substitution",
        "left right",
        "left parse right",
    ),
    "PackageNotFoundError": NameKind(
        "",
        "**",
        "",
    ),
    "launch_ros.parameter_descriptions.Parameter": NameKind(
        "",
        "name value * value_type=",
        "evaluate name value value_type",
    ),
    "launch_ros.substitutions.Parameter": NameKind(
        "Substitution",
        "name * default=",
        "name parse",
    ),
    "ParameterFile": NameKind(
        "",
        "param_file * allow_substs=",
        "allow_substs cleanup evaluate param_file",
    ),
    "ParameterValue": NameKind(
        "",
        "value * value_type=",
        "evaluate value value_type",
    ),
    "PathJoinSubstitution": NameKind(
        "Substitution",
        "substitutions",
        "substitutions",
    ),
    "PluginException": NameKind(
        "",
        "**",
        "",
    ),
    "PopEnvironment": NameKind(
        "Action",
        "* condition=",
        "",
    ),
    "PopLaunchConfigurations": NameKind(
        "Action",
        "* condition=",
        "",
    ),
    "ProcessExited": NameKind(
        "RunningProcessEvent",
        "* returncode action name cmd cwd env pid",
        "returncode",
    ),
    "ProcessIO": NameKind(
        "RunningProcessEvent",
        "* text fd action name cmd cwd env pid",
        "from_stderr from_stdin from_stdout text",
    ),
    "ProcessStarted": NameKind(
        "RunningProcessEvent",
        "* action name cmd cwd env pid",
        "",
    ),
    "ProcessStderr": NameKind(
        "ProcessIO",
        "* text action name cmd cwd env pid",
        "",
    ),
    "ProcessStdin": NameKind(
        "ProcessIO",
        "* text action name cmd cwd env pid",
        "",
    ),
    "ProcessStdout": NameKind(
        "ProcessIO",
        "* text action name cmd cwd env pid",
        "",
    ),
    "ProcessTargetedEvent": NameKind(
        "Event",
        "* process_matcher",
        "process_matcher",
    ),
    "PushEnvironment": NameKind(
        "Action",
        "* condition=",
        "",
    ),
    "PushLaunchConfigurations": NameKind(
        "Action",
        "* condition=",
        "",
    ),
    "PushROSNamespace": NameKind(
        "Action",
        "namespace * condition=",
        "namespace",
    ),
    "PythonExpression": NameKind(
        "Substitution",
        "expression python_modules=",
        "expression parse python_modules",
    ),
    "PythonLaunchDescriptionSource": NameKind(
        "LaunchDescriptionSource",
        "launch_file_path",
        "",
    ),
    "ROSAdapter": NameKind(
        "",
        "* argv= autostart=",
        "argv ros_context ros_executor ros_node shutdown start",
    ),
    "ROSTimer": NameKind(
        "TimerAction",
        "* period actions cancel_on_shutdown= condition=",
        "",
    ),
    "RegisterEventHandler": NameKind(
        "Action",
        "event_handler * condition=",
        "event_handler",
    ),
    "ResetEnvironment": NameKind(
        "Action",
        "* condition=",
        "",
    ),
    "ResetLaunchConfigurations": NameKind(
        "Action",
        "launch_configurations= * condition=",
        "",
    ),
    "RunningProcessEvent": NameKind(
        "Event",
        "* action name cmd cwd env pid",
        "action cmd cwd env execute_process_action pid process_name",
    ),
    "SetEnvironmentVariable": NameKind(
        "Action",
        "name value * condition=",
        "name value",
    ),
    "SetLaunchConfiguration": NameKind(
        "Action",
        "name value * condition=",
        "name value",
    ),
    "SetParameter": NameKind(
        "Action",
        "name value * condition=",
        "name value",
    ),
    "SetParametersFromFile": NameKind(
        "Action",
        "filename * condition=",
        "",
    ),
    "SetROSLogDir": NameKind(
        "Action",
        "new_log_dir * condition=",
        "log_dir",
    ),
    "SetRemap": NameKind(
        "Action",
        "src dst * condition=",
        "dst src",
    ),
    "SetUseSimTime": NameKind(
        "Action",
        "value * condition=",
        "value",
    ),
    "launch.actions.Shutdown": NameKind(
        "EmitEvent",
        "* reason= condition=",
        "",
    ),
    "launch.events.Shutdown": NameKind(
        "Event",
        "* reason= due_to_sigint=",
        "due_to_sigint reason",
    ),
    "ShutdownProcess": NameKind(
        "ProcessTargetedEvent",
        "* process_matcher",
        "",
    ),
    "SignalProcess": NameKind(
        "ProcessTargetedEvent",
        "* signal_number process_matcher",
        "signal signal_name",
    ),
    "StateTransition": NameKind(
        "Event",
        "* action msg",
        "action goal_state msg start_state timestamp transition",
    ),
    "Substitution": NameKind(
        "",
        "**",
        "describe perform",
    ),
    "SubstitutionFailure": NameKind(
        "",
        "msg",
        "",
    ),
    "TextSubstitution": NameKind(
        "Substitution",
        "* text",
        "text",
    ),
    "ThisLaunchFile": NameKind(
        "Substitution",
        "",
        "parse",
    ),
    "ThisLaunchFileDir": NameKind(
        "Substitution",
        "",
        "parse",
    ),
    "TimerAction": NameKind(
        "Action",
        "* period actions cancel_on_shutdown= condition=",
        "actions cancel handle period",
    ),
    "TimerEvent": NameKind(
        "Event",
        "* timer_action",
        "timer_action",
    ),
    "UnlessCondition": NameKind(
        "IfCondition",
        "predicate_expression",
        "",
    ),
    "UnregisterEventHandler": NameKind(
        "Action",
        "event_handler * condition=",
        "event_handler",
    ),
    "UnsetEnvironmentVariable": NameKind(
        "Action",
        "name * condition=",
        "name",
    ),
    "UnsetLaunchConfiguration": NameKind(
        "Action",
        "name * condition=",
        "name",
    ),
    "XMLLaunchDescriptionSource": NameKind(
        "FrontendLaunchDescriptionSource",
        "launch_file_path",
        "",
    ),
    "YAMLLaunchDescriptionSource": NameKind(
        "FrontendLaunchDescriptionSource",
        "launch_file_path",
        "",
    ),
}
