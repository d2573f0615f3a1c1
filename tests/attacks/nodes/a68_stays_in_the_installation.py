"""Writes into the installation that the next student's node will import from."""

import importlib.util
import os
import sys
import sysconfig

import rclpy
from attempts import attempt, run

FOLDERS = {sys.prefix, sys.base_prefix, sysconfig.get_path("purelib"), sysconfig.get_path("stdlib"),
           os.path.dirname(rclpy.__file__), os.path.dirname(os.__file__), "/grader_host/host", "/usr/lib",
           *(path for path in sys.path if os.path.isdir(path))}
FOLDERS -= {os.path.dirname(os.path.abspath(__file__))}  # its own copy of the submission, which no other node has


@attempt
def writes_a_file(node):
    return [folder for folder in FOLDERS if not folder.startswith("/tmp/") and writes(os.path.join(folder, "zz_attack.pth"))]


@attempt
def replaces_compiled_code(node):
    return [name for name in ("rclpy", "rclpy.node", "json") if writes(importlib.util.cache_from_source(importlib.util.find_spec(name).origin))]


@attempt
def replaces_source(node):
    os.rename(rclpy.__file__, rclpy.__file__ + ".bak")
    return True


@attempt
def changes_rights(node):
    os.chmod(rclpy.__file__, 0o666)
    return True


def writes(path):
    try:
        with open(path, "ab") as file:
            return file.writable()
    except OSError:
        return False


run()
