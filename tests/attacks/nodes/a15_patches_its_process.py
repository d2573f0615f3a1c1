"""Replaces parts of Python, rclpy and the grader's host in its own process, so that everything looks right."""

import builtins
import json
import sys
import time
import unittest

import rclpy
from attempts import attempt, run


@attempt
def replaces_everything(node):
    unittest.TestCase.assertEqual = lambda *_, **__: True
    builtins.abs = lambda value: 0
    node.get_clock = lambda: None
    for name, module in list(sys.modules.items()):
        if name.startswith("host.") and hasattr(module, "Describer"):
            module.Describer.exception = lambda *_: {}
        if name == "host.virtual":
            for what in ("used_ns", "summary"):
                if hasattr(module.VirtualTime, what):
                    setattr(module.VirtualTime, what, lambda *_: {})
    time.time = time.monotonic = lambda: 0.0
    json.dumps_before = json.dumps
    rclpy.ok = lambda **_: True
    return False


run(rate_hz=5)
