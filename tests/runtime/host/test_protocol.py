"""What the worker believes of what a process reports."""

from __future__ import annotations

from typing import Any

import pytest

from grader.runtime.host.protocol import ORDINARY, Claim

MADE_UP: tuple[Any, ...] = (None, 1.5, "x", [])
QOS = ORDINARY._asdict()
KNOWN = Claim("publisher", "/x", "std_msgs/msg/Float32")
CLAIM = {"kind": "publisher", "name": "/x", "type": "std_msgs/msg/Float32"}


@pytest.mark.parametrize("field", ["qos", "sends", "takes"])
@pytest.mark.parametrize(
    "qos",
    [
        None,
        5,
        [],
        {},
        *({**QOS, name: value} for name in ("reliable", "latched", "manual") for value in MADE_UP),
        *({**QOS, name: value} for name in ("deadline_ns", "lease_ns") for value in MADE_UP),
    ],
)
def test_an_endpoint_with_an_impossible_qos_is_none(field: str, qos: Any) -> None:
    """Who is matched with whom is computed from it."""
    assert Claim.checked({**CLAIM, field: QOS}) == KNOWN
    assert Claim.checked({**CLAIM, field: qos}) is None


@pytest.mark.parametrize("number", [None, "1", 1.5, [], {}])
def test_an_endpoint_without_a_possible_number_has_none(number: Any) -> None:
    """It only tells endpoints of one topic apart."""
    assert Claim.checked({**CLAIM, "number": number}) == KNOWN
    assert Claim.checked({**CLAIM, "number": 7}) == KNOWN._replace(number=7)
