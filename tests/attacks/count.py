"""Runs every attack under one tier of isolation or several, and counts those that were contained.

Usage: python tests/attacks/count.py [--only NUMBER[,NUMBER...]] [TIER...]

Without a tier it takes each one that can be used on this machine. The tier `none` is refused: there the attacks would
harm the machine. The tier `landlock` is tried as it is meant to be used, without a network.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parent / folder) for folder in (".", "../support")]

from arena import UNPRIVILEGED
from attack_runs import Attack, read_attacks, run_unit, units

from grader.runtime.model.checkup import NO_SANDBOX, TIERS
from grader.runtime.ros_installation import find_ros
from grader.runtime.sandbox.choose import Machine, inspect_tiers


def main() -> int:
    """Run what is asked for, print the table, and return 0 if everything was contained."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "tiers", nargs="*", metavar="TIER", help=", ".join(name for name in TIERS if name != NO_SANDBOX)
    )
    parser.add_argument("--only", default="", metavar="NUMBERS", help="only these attacks, e.g. 1,2,64")
    asked = parser.parse_args()
    wanted = {int(number) for number in asked.only.split(",") if number}
    attacks = [attack for attack in read_attacks() if not wanted or attack.number in wanted]
    here = usable_tiers()
    if unknown := [tier for tier in asked.tiers if tier not in TIERS or tier == NO_SANDBOX]:
        parser.error(f"expected tiers out of {', '.join(here)}, found {', '.join(unknown)}")
    results = {tier: count(tier, attacks) for tier in asked.tiers or here}
    print_table(attacks, results)
    return 0 if all(not texts for result in results.values() for texts in result.values()) else 1


def usable_tiers() -> list[str]:
    """Return the tiers whose self-test passes here; as root, those of an ordinary user are counted in."""
    usable = [tier.name for tier in inspect_tiers(Machine(find_ros())) if tier.usable]
    as_user = list(UNPRIVILEGED) if os.geteuid() == 0 else []
    return [name for name in TIERS if name in (*usable, *as_user) and name != NO_SANDBOX]


def count(tier: str, attacks: Sequence[Attack]) -> dict[int, list[str]]:
    """Run attacks in a tier and return what each achieved."""
    achieved: dict[int, list[str]] = {}
    for name, unit in units(attacks).items():
        started = time.monotonic()
        achieved |= run_unit(tier, unit)
        print(f"{tier}: {name}: {time.monotonic() - started:.1f} s", file=sys.stderr, flush=True)
    return achieved


def print_table(attacks: Sequence[Attack], results: Mapping[str, Mapping[int, Sequence[str]]]) -> None:
    """Print the counts, then each attack that was not contained."""
    print(f"{'tier':<18}{'':<4}{'contained':>10}{'not contained':>15}{'of':>5}")
    for tier, achieved in results.items():
        failed = sum(bool(texts) for texts in achieved.values())
        print(f"{tier:<18}{TIERS[tier]:<4}{len(achieved) - failed:>10}{failed:>15}{len(achieved):>5}")
    names = {attack.number: attack.name for attack in attacks}
    for tier, achieved in results.items():
        for number, texts in sorted(achieved.items()):
            if texts:
                print(f"\n{tier}: {number}. {names[number]}", *dict.fromkeys(texts), sep="\n  ")


if __name__ == "__main__":
    sys.exit(main())
