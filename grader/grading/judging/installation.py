"""Tells what this installation lacks, a ROS package or a newer Python, from what a submission should bring."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence

from grader.grading.judging.findings import faults_before_stop
from grader.grading.judging.source import read_source, words
from grader.grading.model.exercise import Location
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.scenario import is_launch_file
from grader.runtime.model.trace import Fault, FaultKind, NewerPython, Trace

#: Python packages that come with a desktop installation of ROS 2 and not with the wheels of rclpy.
ROS_PACKAGES = frozenset(
    words(
        "action_tutorials_interfaces angles catkin_pkg composition_interfaces cv2 cv_bridge domain_coordinator "
        "image_geometry interactive_markers joint_state_publisher laser_geometry launch launch_ros "
        "launch_testing launch_testing_ros launch_xml launch_yaml logging_demo map_msgs matplotlib message_filters "
        "osrf_pycommon pcl_msgs pendulum_msgs PyKDL python_qt_binding qt_gui resource_retriever robot_state_publisher "
        "ros2action ros2bag ros2cli ros2component ros2doctor ros2interface ros2launch ros2lifecycle ros2node ros2param "
        "ros2pkg ros2run ros2service ros2topic rosbag2_interfaces rosbag2_py rosidl_runtime_py rqt_gui rqt_gui_py "
        "sensor_msgs_py sros2 statistics_msgs tf2_geometry_msgs tf2_kdl tf2_py tf2_ros tf2_sensor_msgs "
        "tf2_tools topic_monitor"
    )
) | frozenset(
    # Not of the desktop, but released for it: programs that import them are right wherever they are installed.
    words(
        "ackermann_msgs apriltag_msgs control_msgs controller_manager controller_manager_msgs gazebo_msgs "
        "geographic_msgs irobot_create_msgs launch_pal launch_param_builder launch_pytest mavros_msgs moveit "
        "moveit_configs_utils moveit_msgs nav2_common nav2_msgs nav2_simple_commander nav_2d_msgs octomap_msgs "
        "robot_localization ros_gz_bridge ros_gz_interfaces ros_gz_sim simple_launch slam_toolbox tf2_eigen "
        "tracetools_launch turtlebot3_msgs turtlebot4_msgs ur_msgs vision_msgs webots_ros2_driver xacro"
    )
)


#: Those that no ROS package holds, but that such an installation needs, with the extra of the grader that brings them.
EXTRAS = {"cv2": "opencv", "matplotlib": "plots"}
#: What packages have that the grader lends where ROS brings none of its own, and the lent ones have not.
NOT_LENT: Mapping[str, tuple[str, ...]] = {
    # Launch files have all modules of these; a program that imports one lacks the package itself.
    **dict.fromkeys(("launch", "launch_ros", "launch_xml", "launch_yaml"), ()),
    "cv_bridge": ("boost", "cv_bridge_boost"),
    "message_filters": ("InputAligner",),
    "sensor_msgs_py": ("numpy_compat",),
    "tf2_geometry_msgs": ("transform_to_kdl",),
    "tf2_ros": ("BufferClient", "buffer_client", "StaticTransformListener", "static_transform_listener"),
    "tf_transformations": words(
        "Arcball arcball_constrain_to_axis arcball_map_to_sphere arcball_nearest_axis clip_matrix "
        "orthogonalization_matrix projection_from_matrix projection_matrix reflection_from_matrix scale_from_matrix "
        "shear_from_matrix shear_matrix superimposition_matrix"
    ),
}
#: Endings of the names of packages that hold nothing but interfaces.
INTERFACES = ("_msgs", "_interfaces")


@dataclass(frozen=True, slots=True)
class LackingPackage:
    """A package of ROS that a program imports and this installation lacks."""

    name: str
    fault: Fault


def lacking_package(trace: Trace, processes: Sequence[str], sources: Mapping[str, str]) -> LackingPackage | None:
    """Return the package, or part of one, without which a program of a scenario ended, if its text imports it."""
    launched = any(map(is_launch_file, processes))  # a launch file's nodes have names of their own
    for fault in faults_before_stop(trace):
        if fault.kind is not FaultKind.EXCEPTION or not (launched or fault.process in processes):
            continue
        name = _lacking(fault)
        package = name.partition(".")[0]
        # the import stands in another file of the submission if the fault does
        if name and (
            fault.file.rpartition("/")[2] != fault.process or _imports(sources.get(fault.process, ""), package)
        ):
            return LackingPackage(name, fault)
    return None


def _lacking(fault: Fault) -> str:
    """Return the package, or the part of a lent one, that an exception says is not there; empty for any other."""
    module = fault.said(r"^ModuleNotFoundError: No module named '([\w.]+)'")
    if module is not None:
        package, _, part = module[1].partition(".")
        return package if package in ROS_PACKAGES and (not part or package not in NOT_LENT) else _part(package, part)
    found = fault.said(r"^ImportError: cannot import name '(?P<name>\w+)' from '(?P<of>[\w.]+)'")
    found = found or fault.said(r"^AttributeError: module '(?P<of>[\w.]+)' has no attribute '(?P<name>\w+)'")
    return "" if found is None else _part(found["of"].partition(".")[0], found["name"])


def _part(package: str, name: str) -> str:
    return f"{package}.{name}" if name in NOT_LENT.get(package, ()) else ""


def lacking_python(trace: Trace, processes: Sequence[str], place: Location | None) -> NewerPython | None:
    """Return what programs of a scenario use of the Python of the ROS release, which is newer than the one here.

    Args:
        trace: The recording.
        processes: The programs.
        place: Where points are lost. A file that no Python can read is the student's to correct.
    """
    known = {(one.process, one.file) for one in trace.newer}
    wrong = {f.file for f in trace.faults() if f.kind is FaultKind.SYNTAX_ERROR and (f.process, f.file) not in known}
    if place is not None and place.file in wrong:
        return None
    launched = any(map(is_launch_file, processes))  # a launch file's nodes have names of their own
    return next((one for one in trace.newer if launched or one.process in processes), None)


#: Packages whose results are arrays of numpy, or numbers from one.
_OF_NUMPY = ("numpy", "cv2", "cv_bridge", "scipy", "sensor_msgs_py")
#: What a result of another type, or one that does not fit, leads to.
_NUMBERS_RAISE = ("AssertionError", "OverflowError", "TypeError", "ValueError")


def may_differ_by_numpy(trace: Trace, processes: Sequence[str], sources: Mapping[str, str]) -> bool:
    """Return whether programs of a scenario compute with numpy, and did not end for another reason.

    Args:
        trace: The recording.
        processes: The programs; those of a launch file may be any of the sources.
        sources: Wanted file name -> its text.
    """
    launched = any(map(is_launch_file, processes))
    texts = [text for name, text in sources.items() if launched or name in processes]
    if not any(_imports(text, package) for text in texts for package in _OF_NUMPY):
        return False
    faults = [fault for fault in faults_before_stop(trace) if launched or fault.process in processes]
    return not faults or any(fault.exception in _NUMBERS_RAISE for fault in faults)


def _imports(text: str, package: str) -> bool:
    source = read_source("", text)
    plain = (alias.name for node in source.all(ast.Import) for alias in node.names)
    parts = (node.module or "" for node in source.all(ast.ImportFrom) if not node.level)
    return any(name.partition(".")[0] == package for name in (*plain, *parts))
