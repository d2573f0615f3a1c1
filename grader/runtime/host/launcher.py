"""Entry point of a student's process: runs one unmodified file as `python3 file.py` would, on the grader's clock.

Usage: launcher.py JSON, with an object of `fd`, `root`, `file`, `clock`, `seed` and `limits`.
"""

from __future__ import annotations

import importlib.util
import json
import os
import sys
from typing import Any


def load_package() -> Any:
    """Load the folder of this file as a package, under a name that no student's module has."""
    folder = os.path.dirname(os.path.abspath(__file__))
    spec = importlib.util.spec_from_file_location(
        "_grader_host", os.path.join(folder, "__init__.py"), submodule_search_locations=[folder]
    )
    if spec is None or spec.loader is None:
        raise ImportError(folder)
    package = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = package
    spec.loader.exec_module(package)
    # First of all: what a program has not imported is hidden from it.
    importlib.import_module("_grader_host.unseen").IMPORTS.begin()
    return importlib.import_module("_grader_host.program")


if __name__ == "__main__":
    request = json.loads(sys.argv[1])
    sys.path[:1] = request.get("python_paths", [])  # in place of this file's own folder
    program = load_package()
    (program.evaluate if "launch" in request else program.run)(request)
