from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument("topic", default_value="chatter"),
            Node(package="robot", executable="listener", remappings=[("chatter", LaunchConfiguration("topic"))]),
        ]
    )
