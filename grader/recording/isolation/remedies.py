"""What to do about a tier that does not hold: one command, chosen by what this machine says about itself."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from grader.model.containment import TierReport

#: Settings that keep bubblewrap from making namespaces, the value that does, and the one that lets it.
SETTINGS = (
    ("kernel.apparmor_restrict_unprivileged_userns", "1", "0"),
    ("kernel.unprivileged_userns_clone", "0", "1"),
    ("user.max_user_namespaces", "0", "15000"),
)
INSTALLERS = {
    "apt-get": "apt-get install -y",
    "dnf": "dnf install -y",
    "pacman": "pacman -S --noconfirm",
    "zypper": "zypper install -y",
    "apk": "apk add",
}
IN_CONTAINER = "start the container without a network: docker run --network none"


def install_command(package: str) -> str:
    """Return the command that installs a package of the system."""
    installer = next((command for name, command in INSTALLERS.items() if shutil.which(name)), INSTALLERS["apt-get"])
    return f"{_sudo()}{installer} {package}"


def remedy_for(report: TierReport) -> str:
    """Return the command or action that would make a tier hold; empty if none is known."""
    if any(found.name == "net_egress" and not found.holds for found in report.properties):
        return IN_CONTAINER if confined() else ""
    if report.name.startswith("bubblewrap") and not report.properties:
        return setting_command()
    return ""


def setting_command() -> str:
    """Return the command that lets an ordinary user's bubblewrap make namespaces; empty if it may, or is confined."""
    for name, bad, good in SETTINGS:
        path = Path("/proc/sys", *name.split("."))
        if path.is_file() and path.read_text(encoding="ascii").strip() == bad:
            return f"{_sudo()}sysctl -w {name}={good}"
    return ""


def confined() -> bool:
    """Return whether a seccomp filter lies on this process, as containers have it."""
    status = Path("/proc/self/status").read_text(encoding="utf-8", errors="replace")
    return any(line.split() == ["Seccomp:", "2"] for line in status.splitlines())


def _sudo() -> str:
    return "" if os.geteuid() == 0 else "sudo "
