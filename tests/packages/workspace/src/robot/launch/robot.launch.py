import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, IncludeLaunchDescription
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node, PushRosNamespace
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    share = get_package_share_directory("robot")
    listener = PathJoinSubstitution([FindPackageShare("robot"), "launch", "listener.launch.py"])
    return LaunchDescription(
        [
            DeclareLaunchArgument("rate", default_value="4.0", description="messages a second"),
            DeclareLaunchArgument("listen", default_value="true"),
            Node(
                package="robot",
                executable="talker",
                name="speaker",
                output="screen",
                parameters=[os.path.join(share, "config", "talker.yaml"), {"rate": LaunchConfiguration("rate")}],
                remappings=[("chatter", "/talk")],
            ),
            GroupAction(
                [
                    PushRosNamespace("ears"),
                    IncludeLaunchDescription(
                        PythonLaunchDescriptionSource(listener), launch_arguments={"topic": "/talk"}.items()
                    ),
                ],
                condition=IfCondition(LaunchConfiguration("listen")),
            ),
        ]
    )
