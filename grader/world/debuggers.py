"""Says where the debugger of a test's programs is: at a terminal, or at a port."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from typing import Any


def debugger_at(terminal: str, port: int | None = None) -> str:
    """Return where a debugger of programs is, as `Plan.debugger`.

    Args:
        terminal: The device of a terminal; empty for none.
        port: The first port at which programs wait for a debugger; None if they do not.

    Raises:
        ImportError: Programs are to wait for a debugger, but the package debugpy is not installed.
    """
    told: dict[str, Any] = {"terminal": terminal}
    if port is not None:
        spec = importlib.util.find_spec("debugpy")
        if spec is None or spec.origin is None:
            raise ImportError("the package debugpy is not installed")
        told |= {"port": port, "folder": str(Path(spec.origin).parents[1])}
    return json.dumps(told)
