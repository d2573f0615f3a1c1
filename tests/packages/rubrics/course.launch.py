from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, ThisLaunchFileDir
from launch_ros.actions import Node, PushRosNamespace, SetRemap


def generate_launch_description():
    given = PathJoinSubstitution([ThisLaunchFileDir(), "given.yaml"])
    parameters = [given, {"rate": LaunchConfiguration("rate")}]
    return LaunchDescription(
        [
            DeclareLaunchArgument("rate", default_value="1.0"),
            GroupAction(
                [
                    PushRosNamespace("course"),
                    SetRemap("chatter", "talk"),
                    Node(package="student", executable="talker", parameters=parameters),
                    Node(package="student", executable="hearer"),
                ]
            ),
        ]
    )
