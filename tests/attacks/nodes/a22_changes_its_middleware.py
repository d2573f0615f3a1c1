"""Moves to another domain and another transport before ROS starts, where nobody watches."""

import os

os.environ["ROS_DOMAIN_ID"] = "99"
os.environ["RMW_IMPLEMENTATION"] = "rmw_cyclonedds_cpp"
os.environ["FASTDDS_BUILTIN_TRANSPORTS"] = "SHM"
os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = "/submission/profile.xml"

from attempts import attempt, run


@attempt
def moved(node):
    return False


run()
