"""The public names of each module of ROS's own `launch` packages and of `ament_index_python`.

Names only, read from the branches `jazzy` of ros2/launch (09403fc, after 3.4.3), ros2/launch_ros (62c56e5, after
0.26.6) and ament/ament_index (0a35ca6, after 1.8.1), of December 2024.
"""

from __future__ import annotations

from collections.abc import Mapping

#: The release that the names are of; another one may have others.
RELEASE = "jazzy"
#: What releases after Jazzy have, or may have brought back to it since.
LATER: Mapping[str, str] = {
    "launch.actions": ("ForEach ForLoop Log LogDebug LogError LogWarning ScopedIncludeLaunchDescription"),
    "launch.substitutions": "BooleanSubstitution ForEachVar ForLoopIndex PathSubstitution StringJoinSubstitution",
    "launch_ros.descriptions": "ComposableLifecycleNode",
}
#: Names by module.
MODULES: Mapping[str, str] = {
    "ament_index_python": (
        "InvalidResourceNameError InvalidResourceTypeNameError PackageNotFoundError RESOURCE_INDEX_SUBFOLDER "
        "constants get_package_prefix get_package_share_directory get_package_share_path get_packages_with_prefixes "
        "get_resource get_resource_types get_resources get_search_paths has_resource packages resources "
        "search_paths"
    ),
    "ament_index_python.constants": "AMENT_PREFIX_PATH_ENV_VAR RESOURCE_INDEX_SUBFOLDER",
    "ament_index_python.packages": (
        "PackageNotFoundError get_package_prefix get_package_share_directory get_package_share_path "
        "get_packages_with_prefixes get_resource get_resources get_search_paths"
    ),
    "ament_index_python.resources": (
        "InvalidResourceNameError InvalidResourceTypeNameError RESOURCE_INDEX_SUBFOLDER get_resource "
        "get_resource_types get_resources get_search_paths has_resource"
    ),
    "ament_index_python.search_paths": "AMENT_PREFIX_PATH_ENV_VAR get_search_paths",
    "launch": (
        "Action Condition Event EventHandler InvalidLaunchFileError LaunchContext LaunchDescription "
        "LaunchDescriptionEntity LaunchDescriptionSource LaunchIntrospector LaunchService SomeEntitiesType "
        "SomeEntitiesType_types_tuple SomeSubstitutionsType SomeSubstitutionsType_types_tuple Substitution action "
        "actions condition conditions descriptions event event_handler event_handlers events frontend "
        "invalid_launch_file_error launch_context launch_description launch_description_entity "
        "launch_description_source launch_description_sources launch_introspector launch_service logging "
        "some_entities_type some_substitutions_type substitution substitutions utilities"
    ),
    "launch.action": "Action Condition Entity LaunchContext LaunchDescriptionEntity Parser",
    "launch.actions": (
        "AppendEnvironmentVariable DeclareLaunchArgument EmitEvent ExecuteLocal ExecuteProcess GroupAction "
        "IncludeLaunchDescription LogInfo OpaqueCoroutine OpaqueFunction PopEnvironment PopLaunchConfigurations "
        "PushEnvironment PushLaunchConfigurations RegisterEventHandler ResetEnvironment ResetLaunchConfigurations "
        "SetEnvironmentVariable SetLaunchConfiguration Shutdown TimerAction UnregisterEventHandler "
        "UnsetEnvironmentVariable UnsetLaunchConfiguration append_environment_variable declare_launch_argument "
        "emit_event execute_local execute_process group_action include_launch_description log_info opaque_coroutine "
        "opaque_function pop_environment pop_launch_configurations push_environment push_launch_configurations "
        "register_event_handler reset_environment reset_launch_configurations set_environment_variable "
        "set_launch_configuration shutdown_action timer_action unregister_event_handler unset_environment_variable "
        "unset_launch_configuration"
    ),
    "launch.actions.append_environment_variable": (
        "Action AppendEnvironmentVariable Entity LaunchContext NormalizedValueType Parser SomeSubstitutionsType "
        "Substitution expose_action normalize_to_list_of_substitutions normalize_typed_substitution "
        "perform_substitutions perform_typed_substitution"
    ),
    "launch.actions.declare_launch_argument": (
        "Action DeclareLaunchArgument Entity LaunchContext Parser SomeSubstitutionsType Substitution expose_action "
        "launch normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch.actions.emit_event": "Action EmitEvent Event LaunchContext is_a_subclass",
    "launch.actions.execute_local": (
        "Action EmitEvent Event EventHandler Executable ExecuteLocal LaunchConfiguration LaunchContext "
        "LaunchDescription LaunchDescriptionEntity OnProcessExit OnProcessIO OnProcessStart OnShutdown "
        "OpaqueFunction ProcessExited ProcessIO ProcessStarted ProcessStderr ProcessStdin ProcessStdout "
        "PythonExpression Shutdown ShutdownProcess SignalProcess SomeEntitiesType SomeSubstitutionsType "
        "Substitution TimerAction evaluate_condition_expression is_a_subclass launch matches_action "
        "normalize_to_list_of_substitutions normalize_typed_substitution perform_substitutions "
        "perform_typed_substitution"
    ),
    "launch.actions.execute_process": (
        "Entity Executable ExecuteLocal ExecuteProcess Parser Shutdown SomeSubstitutionsType Substitution "
        "TextSubstitution expose_action"
    ),
    "launch.actions.group_action": (
        "Action Entity GroupAction LaunchContext LaunchDescriptionEntity Parser PopEnvironment "
        "PopLaunchConfigurations PushEnvironment PushLaunchConfigurations ResetEnvironment "
        "ResetLaunchConfigurations SetLaunchConfiguration SomeSubstitutionsType expose_action"
    ),
    "launch.actions.include_launch_description": (
        "Action AnyLaunchDescriptionSource Entity IncludeLaunchDescription LaunchContext LaunchDescriptionEntity "
        "LaunchDescriptionSource Parser SetLaunchConfiguration SomeSubstitutionsType expose_action launch "
        "normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch.actions.log_info": (
        "Action Entity LaunchContext LogInfo Parser SomeSubstitutionsType Substitution expose_action launch "
        "normalize_to_list_of_substitutions"
    ),
    "launch.actions.opaque_coroutine": (
        "Action Event LaunchContext LaunchDescriptionEntity OnShutdown OpaqueCoroutine SomeEntitiesType "
        "ensure_argument_type"
    ),
    "launch.actions.opaque_function": (
        "Action LaunchContext LaunchDescriptionEntity OpaqueFunction ensure_argument_type"
    ),
    "launch.actions.pop_environment": "Action LaunchContext PopEnvironment",
    "launch.actions.pop_launch_configurations": "Action LaunchContext PopLaunchConfigurations",
    "launch.actions.push_environment": "Action LaunchContext PushEnvironment",
    "launch.actions.push_launch_configurations": "Action LaunchContext PushLaunchConfigurations",
    "launch.actions.register_event_handler": (
        "Action BaseEventHandler LaunchContext LaunchDescriptionEntity RegisterEventHandler "
        "normalize_to_list_of_entities"
    ),
    "launch.actions.reset_environment": "Action Entity LaunchContext Parser ResetEnvironment expose_action",
    "launch.actions.reset_launch_configurations": (
        "Action Entity LaunchContext Parser ResetLaunchConfigurations SomeSubstitutionsType expose_action "
        "normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch.actions.set_environment_variable": (
        "Action Entity LaunchContext Parser SetEnvironmentVariable SomeSubstitutionsType Substitution expose_action "
        "normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch.actions.set_launch_configuration": (
        "Action Entity LaunchContext Parser SetLaunchConfiguration SomeSubstitutionsType Substitution expose_action "
        "normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch.actions.shutdown_action": (
        "EmitEvent Entity LaunchContext Parser ProcessExited Shutdown ShutdownEvent expose_action"
    ),
    "launch.actions.timer_action": (
        "Action Entity EventHandler LaunchContext LaunchDescriptionEntity OpaqueFunction Parser Shutdown "
        "SomeEntitiesType SomeSubstitutionsType SomeSubstitutionsType_types_tuple TimerAction TimerEvent "
        "ensure_argument_type expose_action is_a_subclass launch type_utils"
    ),
    "launch.actions.unregister_event_handler": "Action BaseEventHandler LaunchContext UnregisterEventHandler",
    "launch.actions.unset_environment_variable": (
        "Action Entity LaunchContext Parser SomeSubstitutionsType Substitution UnsetEnvironmentVariable "
        "expose_action normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch.actions.unset_launch_configuration": (
        "Action LaunchContext SomeSubstitutionsType Substitution UnsetLaunchConfiguration "
        "normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch.condition": "Condition LaunchContext",
    "launch.conditions": (
        "IfCondition InvalidConditionExpressionError LaunchConfigurationEquals LaunchConfigurationNotEquals "
        "UnlessCondition evaluate_condition_expression evaluate_condition_expression_impl if_condition "
        "invalid_condition_expression_error launch_configuration_equals launch_configuration_not_equals "
        "unless_condition"
    ),
    "launch.conditions.evaluate_condition_expression_impl": (
        "InvalidConditionExpressionError LaunchContext Substitution VALID_FALSE_EXPRESSIONS VALID_TRUE_EXPRESSIONS "
        "evaluate_condition_expression perform_substitutions"
    ),
    "launch.conditions.if_condition": (
        "Condition IfCondition LaunchContext SomeSubstitutionsType evaluate_condition_expression "
        "normalize_to_list_of_substitutions"
    ),
    "launch.conditions.invalid_condition_expression_error": "InvalidConditionExpressionError Substitution",
    "launch.conditions.launch_configuration_equals": (
        "Condition LaunchConfigurationEquals LaunchContext SomeSubstitutionsType Substitution "
        "normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch.conditions.launch_configuration_not_equals": (
        "LaunchConfigurationEquals LaunchConfigurationNotEquals LaunchContext SomeSubstitutionsType"
    ),
    "launch.conditions.unless_condition": "IfCondition LaunchContext SomeSubstitutionsType UnlessCondition",
    "launch.descriptions": "Executable executable",
    "launch.descriptions.executable": (
        "Action Executable LaunchConfiguration LaunchContext SomeSubstitutionsType Substitution "
        "normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch.event": "Event",
    "launch.event_handler": "BaseEventHandler Event EventHandler SomeEntitiesType",
    "launch.event_handlers": (
        "OnExecutionComplete OnIncludeLaunchDescription OnProcessExit OnProcessIO OnProcessStart OnShutdown "
        "event_named on_action_event_base on_execution_complete on_include_launch_description on_process_exit "
        "on_process_io on_process_start on_shutdown"
    ),
    "launch.event_handlers.event_named": "Event event_named",
    "launch.event_handlers.on_action_event_base": (
        "BaseEventHandler Event LaunchContext LaunchDescriptionEntity OnActionEventBase SomeEntitiesType"
    ),
    "launch.event_handlers.on_execution_complete": (
        "Event ExecutionComplete LaunchContext OnActionEventBase OnExecutionComplete SomeEntitiesType"
    ),
    "launch.event_handlers.on_include_launch_description": (
        "EventHandler IncludeLaunchDescription OnIncludeLaunchDescription is_a_subclass"
    ),
    "launch.event_handlers.on_process_exit": (
        "Event LaunchContext OnActionEventBase OnProcessExit ProcessExited SomeEntitiesType"
    ),
    "launch.event_handlers.on_process_io": (
        "Event LaunchContext OnActionEventBase OnProcessIO ProcessIO SomeEntitiesType"
    ),
    "launch.event_handlers.on_process_start": (
        "Event LaunchContext OnActionEventBase OnProcessStart ProcessStarted SomeEntitiesType"
    ),
    "launch.event_handlers.on_shutdown": (
        "BaseEventHandler Event OnShutdown Shutdown SomeEntitiesType gen_handler is_a_subclass"
    ),
    "launch.events": (
        "ExecutionComplete IncludeLaunchDescription Shutdown TimerEvent execution_complete "
        "include_launch_description matchers matches_action process shutdown timer_event"
    ),
    "launch.events.execution_complete": "Action Event ExecutionComplete",
    "launch.events.include_launch_description": "Event IncludeLaunchDescription LaunchDescription",
    "launch.events.matchers": "Action matches_action",
    "launch.events.process": (
        "ProcessExited ProcessIO ProcessStarted ProcessStderr ProcessStdin ProcessStdout ProcessTargetedEvent "
        "RunningProcessEvent ShutdownProcess SignalProcess matches_executable matches_name matches_pid "
        "process_exited process_io process_matchers process_started process_stderr process_stdin process_stdout "
        "process_targeted_event running_process_event shutdown_process signal_process"
    ),
    "launch.events.process.process_exited": "ProcessExited RunningProcessEvent",
    "launch.events.process.process_io": "ProcessIO RunningProcessEvent",
    "launch.events.process.process_matchers": "matches_executable matches_name matches_pid",
    "launch.events.process.process_started": "ProcessStarted RunningProcessEvent",
    "launch.events.process.process_stderr": "ProcessIO ProcessStderr",
    "launch.events.process.process_stdin": "ProcessIO ProcessStdin",
    "launch.events.process.process_stdout": "ProcessIO ProcessStdout",
    "launch.events.process.process_targeted_event": "Event ProcessTargetedEvent",
    "launch.events.process.running_process_event": "Event RunningProcessEvent",
    "launch.events.process.shutdown_process": "ProcessTargetedEvent ShutdownProcess",
    "launch.events.process.signal_process": "ProcessTargetedEvent SignalProcess ensure_argument_type",
    "launch.events.shutdown": "Event Shutdown",
    "launch.events.timer_event": "Event TimerEvent",
    "launch.frontend": (
        "Entity InvalidFrontendLaunchFileError Parser entity expose expose_action expose_substitution "
        "parse_substitution parser type_utils"
    ),
    "launch.frontend.entity": "Entity TargetType",
    "launch.frontend.expose": (
        "Action Entity Parser SomeSubstitutionsType Substitution action_parse_methods expose_action "
        "expose_substitution instantiate_action instantiate_substitution substitution_parse_methods"
    ),
    "launch.frontend.parse_substitution": (
        "ExtractSubstitution NormalizedValueType StrSomeValueType TextSubstitution get_grammar_path "
        "get_package_share_directory instantiate_substitution parse_if_substitutions parse_substitution "
        "replace_escaped_characters"
    ),
    "launch.frontend.parser": (
        "Action Entity FilePath InvalidFrontendLaunchFileError InvalidLaunchFileError NormalizedValueType Parser "
        "StrSomeValueType Substitution instantiate_action parse_if_substitutions parse_substitution "
        "replace_escaped_characters"
    ),
    "launch.frontend.type_utils": (
        "AllowedTypesType Entity check_is_list_entity get_data_type_from_identifier is_typing_list"
    ),
    "launch.invalid_launch_file_error": "InvalidLaunchFileError",
    "launch.launch_context": "BaseEventHandler Event LaunchContext Substitution launch",
    "launch.launch_description": (
        "Action DeclareLaunchArgument LaunchContext LaunchDescription LaunchDescriptionEntity launch"
    ),
    "launch.launch_description_entity": "LaunchDescriptionEntity",
    "launch.launch_description_source": (
        "LaunchContext LaunchDescription LaunchDescriptionSource SomeSubstitutionsType launch "
        "normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch.launch_description_sources": (
        "AnyLaunchDescriptionSource FrontendLaunchDescriptionSource InvalidFrontendLaunchFileError "
        "InvalidLaunchFileError InvalidPythonLaunchFileError PythonLaunchDescriptionSource "
        "any_launch_description_source any_launch_file_utilities frontend_launch_description_source "
        "frontend_launch_file_utilities get_launch_description_from_any_launch_file "
        "get_launch_description_from_frontend_launch_file get_launch_description_from_python_launch_file "
        "load_python_launch_file_as_module python_launch_description_source python_launch_file_utilities"
    ),
    "launch.launch_description_sources.any_launch_description_source": (
        "AnyLaunchDescriptionSource LaunchDescriptionSource SomeSubstitutionsType "
        "get_launch_description_from_any_launch_file"
    ),
    "launch.launch_description_sources.any_launch_file_utilities": (
        "InvalidLaunchFileError LaunchDescription Parser get_launch_description_from_any_launch_file "
        "get_launch_description_from_frontend_launch_file get_launch_description_from_python_launch_file"
    ),
    "launch.launch_description_sources.frontend_launch_description_source": (
        "FrontendLaunchDescriptionSource LaunchDescriptionSource Parser SomeSubstitutionsType "
        "get_launch_description_from_frontend_launch_file"
    ),
    "launch.launch_description_sources.frontend_launch_file_utilities": (
        "InvalidFrontendLaunchFileError LaunchDescription Parser get_launch_description_from_frontend_launch_file"
    ),
    "launch.launch_description_sources.python_launch_description_source": (
        "LaunchDescriptionSource PythonLaunchDescriptionSource SomeSubstitutionsType "
        "get_launch_description_from_python_launch_file"
    ),
    "launch.launch_description_sources.python_launch_file_utilities": (
        "InvalidPythonLaunchFileError LaunchDescription get_launch_description_from_python_launch_file "
        "load_python_launch_file_as_module"
    ),
    "launch.launch_introspector": (
        "Action BaseEventHandler EmitEvent ExecuteProcess LaunchDescription LaunchDescriptionEntity "
        "LaunchIntrospector LogInfo RegisterEventHandler SomeSubstitutionsType format_action format_entities "
        "format_event_handler format_substitutions indent is_a normalize_to_list_of_substitutions tree_like_indent"
    ),
    "launch.launch_service": (
        "AsyncSafeSignalManager Event IncludeLaunchDescription LaunchContext LaunchDescription "
        "LaunchDescriptionEntity LaunchService OnIncludeLaunchDescription OnShutdown Shutdown SomeEntitiesType "
        "launch visit_all_entities_and_collect_futures"
    ),
    "launch.logging": (
        "LaunchConfig LaunchLogger get_logger get_output_loggers handlers launch_config log_launch_config reset"
    ),
    "launch.logging.handlers": "with_per_logger_formatting",
    "launch.some_entities_type": "LaunchDescriptionEntity SomeEntitiesType SomeEntitiesType_types_tuple",
    "launch.some_substitutions_type": "SomeSubstitutionsType SomeSubstitutionsType_types_tuple Substitution",
    "launch.substitution": "Substitution",
    "launch.substitutions": (
        "AllSubstitution AndSubstitution AnonName AnySubstitution Command EnvironmentVariable EqualsSubstitution "
        "FileContent FindExecutable IfElseSubstitution LaunchConfiguration LaunchLogDir LocalSubstitution "
        "NotEqualsSubstitution NotSubstitution OrSubstitution PathJoinSubstitution PythonExpression "
        "SubstitutionFailure TextSubstitution ThisLaunchFile ThisLaunchFileDir anon_name boolean_substitution "
        "command environment_variable equals_substitution file_content find_executable if_else_substitution "
        "launch_configuration launch_log_dir local_substitution not_equals_substitution path_join_substitution "
        "python_expression substitution_failure text_substitution this_launch_file this_launch_file_dir"
    ),
    "launch.substitutions.anon_name": "AnonName LaunchContext SomeSubstitutionsType Substitution expose_substitution",
    "launch.substitutions.boolean_substitution": (
        "AllSubstitution AndSubstitution AnySubstitution LaunchContext NotSubstitution OrSubstitution "
        "SomeSubstitutionsType Substitution SubstitutionFailure expose_substitution "
        "normalize_to_list_of_substitutions perform_typed_substitution"
    ),
    "launch.substitutions.command": (
        "Command LaunchContext SomeSubstitutionsType Substitution SubstitutionFailure expose_substitution launch"
    ),
    "launch.substitutions.environment_variable": (
        "EnvironmentVariable LaunchContext SomeSubstitutionsType Substitution SubstitutionFailure expose_substitution"
    ),
    "launch.substitutions.equals_substitution": (
        "EqualsSubstitution LaunchContext SomeSubstitutionsType Substitution expose_substitution is_substitution "
        "normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch.substitutions.file_content": (
        "FileContent LaunchContext SomeSubstitutionsType Substitution SubstitutionFailure expose_substitution"
    ),
    "launch.substitutions.find_executable": (
        "FindExecutable LaunchContext SomeSubstitutionsType Substitution SubstitutionFailure expose_substitution"
    ),
    "launch.substitutions.if_else_substitution": (
        "IfElseSubstitution LaunchContext SomeSubstitutionsType Substitution SubstitutionFailure "
        "expose_substitution normalize_to_list_of_substitutions perform_substitutions perform_typed_substitution"
    ),
    "launch.substitutions.launch_configuration": (
        "LaunchConfiguration LaunchContext SomeSubstitutionsType Substitution SubstitutionFailure expose_substitution"
    ),
    "launch.substitutions.launch_log_dir": (
        "LaunchContext LaunchLogDir SomeSubstitutionsType Substitution expose_substitution launch_logging_config"
    ),
    "launch.substitutions.local_substitution": "LaunchContext LocalSubstitution Substitution ensure_argument_type",
    "launch.substitutions.not_equals_substitution": (
        "EqualsSubstitution LaunchContext NotEqualsSubstitution expose_substitution"
    ),
    "launch.substitutions.path_join_substitution": "LaunchContext PathJoinSubstitution Substitution",
    "launch.substitutions.python_expression": (
        "LaunchContext PythonExpression SomeSubstitutionsType Substitution ensure_argument_type expose_substitution"
    ),
    "launch.substitutions.substitution_failure": "SubstitutionFailure",
    "launch.substitutions.text_substitution": "LaunchContext Substitution TextSubstitution",
    "launch.substitutions.this_launch_file": (
        "LaunchContext SomeSubstitutionsType Substitution SubstitutionFailure ThisLaunchFile expose_substitution"
    ),
    "launch.substitutions.this_launch_file_dir": (
        "LaunchContext SomeSubstitutionsType Substitution SubstitutionFailure ThisLaunchFileDir expose_substitution"
    ),
    "launch.utilities": (
        "AsyncSafeSignalManager class_tools_impl ensure_argument_type ensure_argument_type_impl is_a is_a_subclass "
        "isclassinstance normalize_to_list_of_entities normalize_to_list_of_entities_impl "
        "normalize_to_list_of_substitutions normalize_to_list_of_substitutions_impl perform_substitutions "
        "perform_substitutions_impl signal_management type_utils typing_file_path "
        "visit_all_entities_and_collect_futures visit_all_entities_and_collect_futures_impl"
    ),
    "launch.utilities.class_tools_impl": "is_a is_a_subclass isclassinstance",
    "launch.utilities.ensure_argument_type_impl": "ensure_argument_type",
    "launch.utilities.normalize_to_list_of_entities_impl": (
        "LaunchDescriptionEntity SomeEntitiesType normalize_to_list_of_entities"
    ),
    "launch.utilities.normalize_to_list_of_substitutions_impl": (
        "SomeSubstitutionsType Substitution is_a_subclass normalize_to_list_of_substitutions"
    ),
    "launch.utilities.perform_substitutions_impl": "LaunchContext Substitution perform_substitutions",
    "launch.utilities.signal_management": "AsyncSafeSignalManager",
    "launch.utilities.type_utils": (
        "AllowedTypesTuple AllowedTypesType AllowedValueType LaunchContext ListTypesTuple ListTypesType "
        "ListValueType NormalizedScalarType NormalizedSequenceType NormalizedValueType ScalarTypesTuple "
        "ScalarTypesType ScalarValueType SequenceValueType SomeScalarType SomeSequenceType SomeSubstitutionsType "
        "SomeValueType StrSomeScalarType StrSomeSequenceType StrSomeValueType Substitution coerce_list "
        "coerce_to_type ensure_argument_type extract_type get_typed_value is_instance_of is_instance_of_valid_type "
        "is_normalized_substitution is_substitution is_typing_list is_valid_scalar_type "
        "normalize_to_list_of_substitutions normalize_typed_substitution perform_substitutions "
        "perform_typed_substitution"
    ),
    "launch.utilities.typing_file_path": "FilePath",
    "launch.utilities.visit_all_entities_and_collect_futures_impl": (
        "LaunchContext LaunchDescriptionEntity visit_all_entities_and_collect_futures"
    ),
    "launch_ros": (
        "actions descriptions event_handlers events parameter_descriptions parameters_type remap_rule_type "
        "ros_adapters substitutions utilities"
    ),
    "launch_ros.actions": (
        "ComposableNodeContainer LifecycleNode LifecycleTransition LoadComposableNodes Node PushROSNamespace "
        "PushRosNamespace ROSTimer RosTimer SetParameter SetParametersFromFile SetROSLogDir SetRemap SetUseSimTime "
        "composable_node_container lifecycle_node lifecycle_transition load_composable_nodes node "
        "push_ros_namespace ros_timer set_parameter set_parameters_from_file set_remap set_ros_log_dir "
        "set_use_sim_time"
    ),
    "launch_ros.actions.composable_node_container": (
        "Action ComposableNode ComposableNodeContainer Entity LaunchContext Node Parser SomeSubstitutionsType "
        "expose_action"
    ),
    "launch_ros.actions.lifecycle_node": (
        "Action ChangeState LifecycleNode Node SomeSubstitutionsType StateTransition get_ros_node launch"
    ),
    "launch_ros.actions.lifecycle_transition": (
        "Action ChangeState EmitEvent LaunchContext LifecycleTransition OnStateTransition RegisterEventHandler "
        "SomeSubstitutionsType StateTransition launch match_node_name_goal match_node_name_start_goal "
        "matches_node_name normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch_ros.actions.load_composable_nodes": (
        "Action ComposableNode ComposableNodeContainer Entity LaunchContext LoadComposableNodes ParameterFile "
        "Parser SomeSubstitutionsType SomeSubstitutionsType_types_tuple add_node_name ensure_argument_type "
        "evaluate_parameters expose_action get_composable_node_load_request get_node_name_count get_ros_node "
        "is_a_subclass launch make_namespace_absolute normalize_parameter_dict normalize_to_list_of_substitutions "
        "perform_substitutions prefix_namespace to_parameters_list"
    ),
    "launch_ros.actions.node": (
        "Action Entity ExecutableInPackage ExecuteProcess LaunchContext LocalSubstitution Node NodeActionExtension "
        "Parameter ParameterFile Parser SomeParameters SomeRemapRules SomeSubstitutionsType add_node_name "
        "ensure_argument_type evaluate_parameters expose_action g_entry_points_impl get_data_type_from_identifier "
        "get_extensions get_node_name_count instantiate_extension launch make_namespace_absolute "
        "normalize_parameters normalize_remap_rules normalize_to_list_of_substitutions perform_substitutions "
        "plugin_support prefix_namespace"
    ),
    "launch_ros.actions.push_ros_namespace": (
        "Action Entity LaunchContext Parser PushROSNamespace SomeSubstitutionsType Substitution SubstitutionFailure "
        "expose_action make_namespace_absolute normalize_to_list_of_substitutions perform_substitutions "
        "prefix_namespace"
    ),
    "launch_ros.actions.ros_timer": (
        "Entity LaunchContext LaunchDescriptionEntity Parser ROSTimer SomeSubstitutionsType "
        "SomeSubstitutionsType_types_tuple TimerAction TimerEvent ensure_argument_type expose_action get_ros_node "
        "type_utils"
    ),
    "launch_ros.actions.set_parameter": (
        "Action Entity LaunchContext ParameterName ParameterValue Parser SetParameter SomeParameterValue "
        "SomeSubstitutionsType evaluate_parameter_dict expose_action normalize_parameter_dict "
        "normalize_to_list_of_substitutions"
    ),
    "launch_ros.actions.set_parameters_from_file": (
        "Action Entity LaunchContext Parser SetParametersFromFile SomeSubstitutionsType expose_action "
        "normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch_ros.actions.set_remap": (
        "Action Entity LaunchContext Parser SetRemap SomeSubstitutionsType Substitution expose_action "
        "normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch_ros.actions.set_ros_log_dir": (
        "Action Entity LaunchContext Parser SetROSLogDir SomeSubstitutionsType Substitution expose_action "
        "normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch_ros.actions.set_use_sim_time": (
        "Action Entity LaunchContext Parser SetUseSimTime expose_action get_ros_node"
    ),
    "launch_ros.descriptions": "ComposableNode Parameter ParameterFile ParameterValue composable_node",
    "launch_ros.descriptions.composable_node": (
        "ComposableNode Condition Entity IfCondition Parameters Parser RemapRules SomeParameters SomeRemapRules "
        "SomeSubstitutionsType Substitution UnlessCondition normalize_parameters normalize_remap_rules "
        "normalize_to_list_of_substitutions"
    ),
    "launch_ros.event_handlers": "OnStateTransition on_state_transition",
    "launch_ros.event_handlers.on_state_transition": (
        "Event EventHandler LifecycleNode OnStateTransition SomeEntitiesType SomeSubstitutionsType StateTransition"
    ),
    "launch_ros.events": "lifecycle matchers matches_node_name",
    "launch_ros.events.lifecycle": (
        "ChangeState StateTransition change_state lifecycle_node_matchers matches_node_name state_transition"
    ),
    "launch_ros.events.lifecycle.change_state": "ChangeState Event LifecycleNode",
    "launch_ros.events.lifecycle.lifecycle_node_matchers": "LifecycleNode matches_node_name",
    "launch_ros.events.lifecycle.state_transition": "Event LifecycleNode StateTransition",
    "launch_ros.events.matchers": "matches_node_name",
    "launch_ros.events.matchers.matches_node_name": "Node matches_node_name",
    "launch_ros.parameter_descriptions": (
        "AllowedTypesType FilePath LaunchContext Parameter ParameterFile ParameterValue SomeSubstitutionsType "
        "SomeSubstitutionsType_types_tuple SomeValueType Substitution SubstitutionFailure ensure_argument_type "
        "normalize_to_list_of_substitutions normalize_typed_substitution parse_substitution perform_substitutions "
        "perform_typed_substitution"
    ),
    "launch_ros.parameters_type": (
        "EvaluatedParameterValue EvaluatedParameters ParameterDescription ParameterFile ParameterName "
        "ParameterValue ParameterValueDescription Parameters ParametersDict SomeParameterFile SomeParameterName "
        "SomeParameterValue SomeParameterValue_types_tuple SomeParameters SomeParametersDict SomeSubstitutionsType "
        "SomeSubstitutionsType_types_tuple Substitution"
    ),
    "launch_ros.remap_rule_type": (
        "RemapRule RemapRules SomeRemapRule SomeRemapRules SomeSubstitutionsType Substitution"
    ),
    "launch_ros.ros_adapters": "ROSAdapter get_ros_adapter get_ros_node launch",
    "launch_ros.substitutions": (
        "ExecutableInPackage FindPackage FindPackagePrefix FindPackageShare Parameter executable_in_package "
        "find_package parameter"
    ),
    "launch_ros.substitutions.executable_in_package": (
        "ExecutableInPackage FindPackagePrefix LaunchContext SomeSubstitutionsType Substitution SubstitutionFailure "
        "expose_substitution normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch_ros.substitutions.find_package": (
        "FindPackage FindPackagePrefix FindPackageShare LaunchContext SomeSubstitutionsType Substitution "
        "expose_substitution get_package_prefix get_package_share_directory normalize_to_list_of_substitutions "
        "perform_substitutions"
    ),
    "launch_ros.substitutions.parameter": (
        "LaunchContext Parameter SomeSubstitutionsType Substitution SubstitutionFailure expose_substitution "
        "normalize_to_list_of_substitutions perform_substitutions"
    ),
    "launch_ros.utilities": (
        "add_node_name evaluate_parameters get_node_name_count is_namespace_absolute is_root_namespace "
        "make_namespace_absolute namespace_utils normalize_parameters normalize_remap_rule normalize_remap_rules "
        "plugin_support prefix_namespace to_parameters_list track_node_names"
    ),
    "launch_ros.utilities.evaluate_parameters": (
        "EvaluatedParameterValue EvaluatedParameters LaunchContext ParameterDescription ParameterFile "
        "ParameterValueDescription Parameters ParametersDict Substitution ensure_argument_type "
        "evaluate_parameter_dict evaluate_parameters perform_substitutions"
    ),
    "launch_ros.utilities.namespace_utils": (
        "OptionalText is_namespace_absolute is_root_namespace make_namespace_absolute prefix_namespace"
    ),
    "launch_ros.utilities.normalize_parameters": (
        "ParameterDescription ParameterFile ParameterValue ParameterValueDescription Parameters ParametersDict "
        "SomeParameterValue SomeParameters SomeParametersDict SomeSubstitutionsType "
        "SomeSubstitutionsType_types_tuple Substitution TextSubstitution ensure_argument_type "
        "normalize_parameter_dict normalize_parameters normalize_to_list_of_substitutions"
    ),
    "launch_ros.utilities.normalize_remap_rule": (
        "RemapRule RemapRules SomeRemapRule SomeRemapRules ensure_argument_type normalize_remap_rule "
        "normalize_remap_rules normalize_to_list_of_substitutions"
    ),
    "launch_ros.utilities.plugin_support": "PluginException get_upper_bound_caret_version satisfies_version",
    "launch_ros.utilities.to_parameters_list": (
        "EvaluatedParameters LaunchContext evaluate_parameter_dict normalize_parameter_dict to_parameters_list"
    ),
    "launch_ros.utilities.track_node_names": "LaunchContext add_node_name get_node_name_count",
    "launch_xml": "Entity Parser entity launch_description_sources parser",
    "launch_xml.entity": "AllowedTypesType AllowedValueType BaseEntity Entity check_is_list_entity get_typed_value",
    "launch_xml.launch_description_sources": "XMLLaunchDescriptionSource xml_launch_description_source",
    "launch_xml.launch_description_sources.xml_launch_description_source": (
        "FrontendLaunchDescriptionSource Parser SomeSubstitutionsType XMLLaunchDescriptionSource"
    ),
    "launch_xml.parser": "Entity Parser frontend",
    "launch_yaml": "Entity Parser entity launch_description_sources parser",
    "launch_yaml.entity": "AllowedTypesType AllowedValueType BaseEntity Entity check_is_list_entity is_instance_of",
    "launch_yaml.launch_description_sources": "YAMLLaunchDescriptionSource yaml_launch_description_source",
    "launch_yaml.launch_description_sources.yaml_launch_description_source": (
        "FrontendLaunchDescriptionSource Parser SomeSubstitutionsType YAMLLaunchDescriptionSource"
    ),
    "launch_yaml.parser": "Entity FilePath Parser frontend",
}
