"""Puts links where a grader might collect logs or clean up, leading to what it wants to read, or to have deleted."""

import os
import shutil

from attempts import attempt, run
from planted import HIDDEN, OUTSIDE

HOME = os.environ.get("HOME", "/tmp")


@attempt
def links(node):
    for place, target in (("log-of-mine", HIDDEN[0]), ("outside", OUTSIDE), ("passwd", "/etc/resolv.conf")):
        for folder in (HOME, os.environ.get("ROS_LOG_DIR", HOME), os.getcwd(), "/tmp"):
            try:
                os.symlink(target, os.path.join(folder, place))
            except OSError:
                continue
    return False


@attempt
def replaces_the_log_folder(node):
    folder = os.environ["ROS_LOG_DIR"]
    shutil.rmtree(folder, ignore_errors=True)
    os.symlink(OUTSIDE, folder)
    return os.listdir(folder) or open(os.path.join(folder, "marker-a67"), "w")


@attempt
def follows_a_link_of_its_own(node):
    with open(os.path.join(HOME, "log-of-mine")) as file:
        return file.read()


run()
