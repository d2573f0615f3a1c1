"""numpy as a worker imports it: when a name in it is first used, and then all of it."""

import subprocess
import sys

import pytest
from tiers import each

START = """
import sys
from grader.runtime.worker import late_numpy
late_numpy.install()
from geometry_msgs.msg import PoseWithCovariance, Twist
from rclpy.serialization import deserialize_message, serialize_message
def loaded():
    return any(name.startswith("numpy.") for name in sys.modules)
assert not loaded()
"""


def run(text: str) -> str:
    """What a program prints that has imported message classes with numpy left out; it has to end well."""
    done = subprocess.run(
        [sys.executable, "-c", START + text], capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.ros
def test_messages_without_arrays_do_without_it() -> None:
    """They are made, written and read."""
    message = "Twist(linear=Twist().linear)"
    assert (
        run(f"print(deserialize_message(serialize_message({message}), Twist) == {message}, loaded())") == "True False"
    )


@pytest.mark.ros
@pytest.mark.parametrize(
    "text",
    each(
        [
            "print(type(PoseWithCovariance().covariance).__name__, loaded())",
            "cdr = serialize_message(PoseWithCovariance(covariance=[1.0] * 36))\n"
            "print(type(deserialize_message(cdr, PoseWithCovariance).covariance).__name__, loaded())",
            "import numpy as np\nprint(np.ndarray.__name__, loaded())",
            "from numpy import ndarray\nprint(ndarray.__name__, loaded())",
            "import numpy.linalg, numpy\nprint(numpy.ndarray.__name__, numpy.linalg is sys.modules['numpy.linalg'])",
            "late_numpy.load_numpy()\nprint('ndarray', loaded())",
        ],
        6,
    ),
)
def test_whatever_uses_it_finds_all_of_it(text: str) -> None:
    """A field, a message from elsewhere, and every way to import it."""
    assert run(text) == "ndarray True"


@pytest.mark.ros
@pytest.mark.long
def test_a_name_that_it_lacks_is_missing() -> None:
    """With numpy's own words."""
    assert "has no attribute 'nothing'" in run(
        "import numpy\ntry:\n    numpy.nothing\nexcept AttributeError as error:\n    print(error)"
    )
