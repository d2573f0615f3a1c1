"""A check on the ROS packages that were handed in: whether a build with colcon installs them."""

from __future__ import annotations

from dataclasses import replace

from grader.grading.judging.findings import met, not_met
from grader.grading.judging.installs import place_of_flaw, told_flaw
from grader.grading.model.exercise import Finding
from grader.grading.model.wording import first_few, quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.projects import ExaminedPackage
from grader.runtime.model.quantities import counted
from grader.runtime.model.trace import Trace

#: How many flaws the evidence lists.
_LISTED = 20


@dataclass(frozen=True, slots=True)
class Installs:
    """The ROS packages that were handed in install with `colcon build`, with all that they need.

    The files of the packages are read, nothing is built. It finds: a package.xml that colcon refuses, files in
    `data_files` or `install()` that are not there, no marker of the ament index, programs that are installed where
    `ros2 run` does not look, entry points to modules or functions that are not there or not installed, launch files and
    files in the share folder that are not installed, names that differ between package.xml, setup.py, setup.cfg and
    CMakeLists.txt, and packages that are imported but not declared. What cannot be known without a build counts as
    right.

    Attributes:
        package: Name of the package; every package of the submission if left out.
    """

    package: str = ""

    @property
    def expected(self) -> str:
        return f"{self.package or 'every package that is handed in'} installs with colcon build"

    def judge(self, trace: Trace) -> Finding:  # noqa: ARG002  a check is asked in this way
        raise HarnessError("the packages of the submission are not known")

    def judge_packages(self, packages: tuple[ExaminedPackage, ...]) -> Finding:
        asked = [one for one in packages if self.package in ("", one.name)]
        if not asked:
            what = f"a package {self.package}" if self.package else "a ROS package"
            found = first_few([quote(one.name) for one in packages]) or "no package.xml"
            return not_met(
                f"submission: expected {what}, found {found}", hint="hand in the whole folder, with package.xml"
            )
        flaws = [flaw for package in asked for flaw in package.flaws]
        names = [quote(package.name) for package in asked]
        if not flaws:
            return met(f"{first_few(names)}: nothing is missing for colcon build", {"packages": names[:_LISTED]})
        told = [told_flaw(flaw) for flaw in flaws]
        more = f"; {counted(len(flaws) - 1, 'more flaw')}" if len(flaws) > 1 else ""
        evidence = {"packages": names[:_LISTED], "flaws": [": ".join(one) for one in told[:_LISTED]]}
        finding = not_met(f"{told[0][0]}{more}", evidence, hint=told[0][1])
        place = place_of_flaw(flaws[0])
        return finding if place is None else replace(finding, location=place)

    def of_beginning(self) -> None:
        return None
