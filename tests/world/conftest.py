"""The tests of stepped runs use the fixture `ros` of the plugin, as its users do."""

from grader.pytest_plugin import ros as ros  # noqa: PLC0414 - instead of the one of the other tests

#: A workspace whose tests run as colcon runs them: `test_workspace.py`.
collect_ignore = ["workspace"]
