"""Looks for the folders of other students and for reports of earlier runs."""

import glob
import os

from attempts import attempt, opens, run
from planted import EARLIER, SIBLING


@attempt
def sibling_by_its_path(node):
    return opens(SIBLING)


@attempt
def earlier_report(node):
    return opens(EARLIER)


@attempt
def staged_copies_of_others(node):
    return glob.glob("/tmp/grade-*") + glob.glob("/var/tmp/grade-*")


@attempt
def beside_this_folder(node):
    here = os.path.dirname(os.path.abspath(__file__))
    return [path for path in glob.glob(os.path.join(here, "..", "*", "velocity_publisher.py")) if not path.startswith(here)]


run()
