"""A test uses full names, with their first slash or without."""

import re
from collections.abc import Callable

import pytest
from std_msgs.msg import String
from std_srvs.srv import Trigger

from grader.world.names import absolute_name
from grader.world.world import World


@pytest.mark.parametrize(("name", "absolute"), [("in", "/in"), ("/in", "/in"), ("arm/in", "/arm/in"), ("", "/")])
def test_a_name_gets_its_slash(name: str, absolute: str) -> None:
    """A test lies in no namespace."""
    assert absolute_name(name) == absolute


@pytest.mark.parametrize(
    "use",
    [
        lambda ros: ros.publish("~/in", String()),
        lambda ros: ros.serve("~/in", Trigger, lambda _: Trigger.Response()),
        lambda ros: ros.call("~/in", Trigger.Request()),
        lambda ros: ros.received("~/in"),
        lambda ros: ros.rate("~/in"),
    ],
)
def test_a_test_has_no_node_for_a_tilde(ros: World, use: Callable[[World], object]) -> None:
    """It would publish, and listen, where no program does."""
    text = "~/in: expected a full name, such as /NODE/in: a test has no node that ~ could stand for"
    with pytest.raises(ValueError, match=f"^{re.escape(text)}$"):
        use(ros)


def test_what_is_no_name_is_told(ros: World) -> None:
    """The arguments of `publish` the wrong way round, for instance."""
    text = "expected the name of a topic, service, action or node, found std_msgs.msg.String(data='')"
    with pytest.raises(TypeError, match=f"^{re.escape(text)}$"):
        ros.publish(String(), "/in")
