"""The tests of stepped runs use the fixture `ros` of the plugin, as its users do."""

from grader.pytest_plugin import ros as ros  # noqa: PLC0414 - instead of the one of the other tests

#: Tests that run in other folders: `test_guests.py` and `test_workspace.py`.
collect_ignore = ["guests", "workspace"]
