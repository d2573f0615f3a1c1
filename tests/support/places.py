"""Where things are: the repository, its tests, what lies beside it, and the command `grade`."""

from __future__ import annotations

import sys
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
ROOT = TESTS.parent
#: Programs and workspaces made after public reports and questions.
REPORTED = TESTS / "reported_programs"
#: What tests may read if it is there; they skip where it is not.
SHARED = ROOT.parent / "shared"
GRADE = str(Path(sys.executable).with_name("grade"))
