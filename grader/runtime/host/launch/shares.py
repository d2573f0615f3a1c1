"""Lays out the share folders of a submission's packages for launch files, as `colcon build` does, and writable.

A share folder has the files of the package under their own names, which setup.py may or may not install, and what
setup.py installs there under another path.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping, Sequence

#: Larger files are linked, and cannot be written to. Launch files write small ones, such as worlds and parameters.
MOST_COPIED = 256 << 10
#: The most bytes that are copied for all packages; the rest is linked. A process may have 16 MiB in a folder.
MOST_BYTES = 4 << 20
#: The least that a file takes there.
BLOCK = 4 << 10


class Shares:
    """The share folders of packages; each is laid out when it is first asked for.

    Args:
        packages: Name and folder of each package.
        prefixes: The folders of AMENT_PREFIX_PATH; below one of them lies what setup.py installs.
        prefix: The folder to lay out in; empty to give the folders of the packages themselves.
    """

    def __init__(self, packages: Mapping[str, str], prefixes: Sequence[str] = (), prefix: str = "") -> None:
        self._packages, self._prefixes, self._prefix = packages, [one for one in prefixes if one], prefix
        self._made: set[str] = set()
        self._left = MOST_BYTES

    def share_of(self, package: str) -> str:
        """Return the share folder of a package of the submission."""
        if not self._prefix:
            return self._packages[package]
        place = os.path.join(self._prefix, "share", package)
        if package not in self._made:
            self._made.add(package)
            for folder in (self._packages[package], *self._installed_of(package)):
                self._lay_out(folder, place)
        return place

    def prefix_of(self, package: str) -> str:
        """Return the folder in which `share/PACKAGE` is the share folder."""
        return os.path.dirname(os.path.dirname(self.share_of(package))) if self._prefix else self._packages[package]

    def source_of(self, path: str) -> str:
        """Return the file of the submission that lies at a path in a share folder; the path itself for any other."""
        for package, folder in self._packages.items():
            place = os.path.join(self._prefix, "share", package, "")
            source = os.path.join(folder, path[len(place) :]) if self._prefix and path.startswith(place) else ""
            if source and os.path.isfile(source):
                return source
        return path

    def found(self, path: str) -> str:
        """Return where a file of a package's own folder is once it is installed, if it is not there before."""
        if os.path.exists(path):
            return path
        for package, folder in self._packages.items():
            if path.startswith(os.path.join(folder, "")):
                for place in self._installed_of(package):
                    there = os.path.join(place, os.path.relpath(path, folder))
                    if os.path.exists(there):
                        return there
        return path

    def _installed_of(self, package: str) -> list[str]:
        return [os.path.join(prefix, "share", package) for prefix in self._prefixes]

    def _lay_out(self, folder: str, place: str) -> None:
        """Copy the files of a folder to a place where they are missing; what is large or beyond the limit is linked."""
        for here, _, files in os.walk(folder):
            there = os.path.normpath(os.path.join(place, os.path.relpath(here, folder)))
            try:
                os.makedirs(there, exist_ok=True)
            except OSError:  # a file is where the folder should be
                continue
            for name in files:
                source, target = os.path.join(here, name), os.path.join(there, name)
                if os.path.lexists(target) or not os.path.isfile(source):
                    continue
                size = max(BLOCK, os.path.getsize(source))
                if size > min(MOST_COPIED, self._left):
                    os.symlink(source, target)
                else:
                    self._left -= size
                    shutil.copyfile(source, target)
