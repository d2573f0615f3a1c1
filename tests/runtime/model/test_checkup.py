"""How the properties of a sandbox are put into words."""

from __future__ import annotations

import pytest

from grader.runtime.model.checkup import (
    NO_SANDBOX,
    PROPERTIES,
    REQUIRED,
    TIERS,
    Property,
    isolation_line,
    missing,
    summarised,
)

ALL = tuple(Property(name, holds=True, mechanism=f"mechanism {n}") for n, name in enumerate(PROPERTIES))
OPEN = (*ALL[:4], Property("net_egress", holds=False, mechanism="no interface but lo", found="eth0"), *ALL[5:])


def test_a_tier_is_described_with_every_property_and_its_mechanism() -> None:
    """In one line, in the order of the table."""
    text = isolation_line("bubblewrap", ALL)
    assert text.startswith("bubblewrap (A1): fs_read by mechanism 0; fs_write by mechanism 1; ")
    assert [part.split()[0] for part in text.partition(": ")[2].split("; ")] == list(PROPERTIES)


def test_what_is_not_contained_is_said_with_what_was_found() -> None:
    """Loudly, in the long form as in the short one."""
    assert "; net_egress NOT CONTAINED (eth0); " in isolation_line("landlock", OPEN)
    assert summarised("landlock", OPEN) == "landlock, NOT contained: net_egress"
    assert summarised("landlock", ALL) == "landlock, all 11 properties contained"


@pytest.mark.parametrize("properties", [(), ALL])
def test_no_walls_are_exactly_none(properties: tuple[Property, ...]) -> None:
    """Programs compare the word; people get more of them."""
    assert isolation_line(NO_SANDBOX, properties) == "none"
    assert "no sandbox" in summarised(NO_SANDBOX, properties)


@pytest.mark.parametrize("name", PROPERTIES)
def test_only_what_is_required_is_missed(name: str) -> None:
    """In the order of the table."""
    properties = tuple(Property(prop, holds=prop != name, mechanism="a mechanism") for prop in PROPERTIES)
    assert [found.name for found in missing(properties)] == ([name] if name in REQUIRED else [])


def test_every_tier_has_a_letter_of_its_own() -> None:
    """Reports and documents use both."""
    assert sorted(TIERS.values()) == ["A1", "A2", "B", "C", "D"]
