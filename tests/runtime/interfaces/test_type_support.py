"""Type support without compiled code beside the compiled one: the same classes, descriptions and exchanges."""

import json
import os
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest
import test_msgs
from samples import SHARE, installed_packages, share_without
from sandboxes import DOMAIN
from tiers import more

from grader.runtime.interfaces.build import BuiltInterfaces, build
from grader.runtime.interfaces.definitions import (
    DefinitionError,
    DefinitionFile,
    InterfacePackage,
    find_packages,
    shipped_packages,
)

HERE = Path(__file__).parent
PYTHON_PACKAGES = Path(test_msgs.__file__).parents[1]


def definitions_of(*names: str) -> tuple[InterfacePackage, ...]:
    return tuple(package for name in names for package in find_packages(SHARE / name))


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> BuiltInterfaces:
    """test_msgs, built as if it were not installed."""
    folder = tmp_path_factory.mktemp("built")
    return build(definitions_of("test_msgs"), folder / "cache", [share_without(folder / "share", "test_msgs")])


def environment(*built: BuiltInterfaces) -> dict[str, str]:
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(str(each.python) for each in built),
        "ROS_DOMAIN_ID": DOMAIN,
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_PYTHON_CHECK_FIELDS": "1",
    }


def run(text: str, *built: BuiltInterfaces) -> str:
    """What a program prints; it has to end well."""
    done = subprocess.run(
        [sys.executable, "-c", text],
        env=environment(*built),
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def assert_as_installed(built: BuiltInterfaces) -> None:
    written = [path.relative_to(built.python) for path in built.python.glob("[!_]*/*/*.py")]
    for path in written:
        assert (built.python / path).read_text() == (PYTHON_PACKAGES / path).read_text()
    described = [path.relative_to(built.share) for path in built.share.glob("*/*/*.json")]
    for path in described:
        assert json.loads((built.share / path).read_text()) == json.loads((SHARE / path).read_text())
    assert len(written) > len(described) > 0


@pytest.mark.long
def test_classes_and_descriptions_are_those_of_the_installed_package(built: BuiltInterfaces) -> None:
    assert_as_installed(built)


@pytest.mark.nightly
def test_classes_and_descriptions_are_those_of_all_installed_packages(tmp_path: Path) -> None:
    names = [name for name in installed_packages() if any((SHARE / name).glob("*/*.msg"))]
    share = share_without(tmp_path / "share", *names)
    assert_as_installed(build(definitions_of(*names), tmp_path / "cache", [share]))


#: Hashes of releases of ROS 2, as `ros2 topic info --verbose`, bags and the design of rmw_zenoh tell them.
PUBLISHED = {
    "tf2_msgs/msg/TFMessage": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    "example_interfaces/srv/AddTwoInts": "e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a",
    "example_interfaces/action/Fibonacci_Goal": "226cb437e4355dcd3e914f930382a3b0cc1da81545bd319ed554e95a03255f51",
}


@pytest.mark.nightly
def test_shipped_packages_have_the_hashes_of_the_releases(tmp_path: Path) -> None:
    made = build(shipped_packages(), tmp_path, [SHARE])
    assert made.names == ("example_interfaces", "tf2_msgs", "turtlesim")
    hashes = {
        each["type_name"]: each["hash_string"]
        for path in made.share.glob("*/*/*.json")
        for each in json.loads(path.read_text())["type_hashes"]
    }
    assert {name: hashes[name] for name in PUBLISHED} == {name: f"RIHS01_{text}" for name, text in PUBLISHED.items()}
    printed = run("from turtlesim.msg import Pose; from tf2_msgs.msg import TFMessage; print(Pose(x=1.0))", made)
    assert printed.startswith("turtlesim.msg.Pose(x=1.0,")


@pytest.mark.breadth(0, 1)
@pytest.mark.ros
@pytest.mark.parametrize("both", [False, *more([True])])
def test_exchanges_with_the_compiled_type_support(built: BuiltInterfaces, *, both: bool) -> None:
    sides = (("ours", "theirs", [built]), ("theirs", "ours", [built] if both else []))
    with ExitStack() as ended:
        processes = []
        for own, other, packages in sides:
            process = subprocess.Popen(
                [sys.executable, str(HERE / "exchange.py"), own, other],
                env=environment(*packages),
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            processes.append(ended.enter_context(process))
            ended.callback(process.kill)
        results = [process.communicate(timeout=600) for process in processes]
    for process, (printed, errors) in zip(processes, results, strict=True):
        assert process.returncode == 0, errors
        told = json.loads(printed)
        published = json.loads((SHARE / "test_msgs/msg/Nested.json").read_text())["type_hashes"][0]["hash_string"]
        assert told == {
            "topics": [True, True, True],
            "response": [["z", "y", "x"], [2.0, 4.0, 6.0]],
            "result": [42, 7],
            "cancel": True,
            "hash": published,
            "described": [True, ["basic_types_value"], ["test_msgs/msg/BasicTypes"]],
            "events": [[1, 1, 0], [2, 0, 1]],
        }


THREADS = """
import sys, threading, time
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from test_msgs.msg import Strings
from test_msgs.srv import BasicTypes

sys.setswitchinterval(1e-6)
rclpy.init()
node = rclpy.create_node("threads")
group = ReentrantCallbackGroup()
publisher = node.create_publisher(Strings, "/t", 1000)
heard = set()
node.create_subscription(Strings, "/t", lambda m: heard.add(m.string_value), 1000, callback_group=group)
def serve(request, response):
    response.int32_value = request.int32_value
    return response
node.create_service(BasicTypes, "/s", serve, callback_group=group)
client = node.create_client(BasicTypes, "/s", callback_group=group)
executor = MultiThreadedExecutor(4)
executor.add_node(node)
done = threading.Event()
def spin():  # with a timeout, because an executor can miss that it is shut down
    while not done.is_set():
        executor.spin_once(timeout_sec=0.1)
spinner = threading.Thread(target=spin)
spinner.start()
answers = []
def use(n):
    for k in range(40):
        publisher.publish(Strings(string_value=f"{n} {k}"))
        answers.append(client.call(BasicTypes.Request(int32_value=k)).int32_value)
deadline = time.monotonic() + 300
while not (publisher.get_subscription_count() and client.service_is_ready()) and time.monotonic() < deadline:
    time.sleep(0.01)
threads = [threading.Thread(target=use, args=(n,)) for n in range(4)]
for each in threads: each.start()
for each in threads: each.join()
deadline = time.monotonic() + 300
while len(heard) < 160 and time.monotonic() < deadline: time.sleep(0.01)
print(len(heard), sorted(answers) == sorted(list(range(40)) * 4))
done.set()
spinner.join()
executor.shutdown()
"""


@pytest.mark.nightly
@pytest.mark.ros
def test_threads_that_publish_take_and_call_at_once_do_not_block_each_other(built: BuiltInterfaces) -> None:
    assert run(THREADS, built).split() == ["160", "True"]


HOSTILE = """
import random, time
import rclpy
from rclpy.serialization import deserialize_message, serialize_message
from test_msgs.msg import BoundedSequences, Strings
from _grader_interfaces.codec import MalformedMessageError

chance, refused = random.Random(1), 0
good = serialize_message(BoundedSequences(string_values=["a", "b"]))
for n in range(300):
    damaged = bytearray(good[: chance.randrange(4, len(good) + 1)])
    damaged[chance.randrange(4, len(damaged)) if len(damaged) > 4 else 3] = chance.randrange(256)
    try:
        deserialize_message(bytes(damaged), BoundedSequences)
    except Exception as error:
        refused += 1
rclpy.init()
node = rclpy.create_node("hostile")
publisher = node.create_publisher(Strings, "/t", 10)
subscription = node.create_subscription(Strings, "/t", print, 10)
while not publisher.get_subscription_count():
    time.sleep(0.01)
publisher.publish(b"\\0\\1\\0\\0\\xff\\xff\\xff\\x7fabc")
publisher.publish(Strings(string_value="after"))
deadline, faults, heard = time.monotonic() + 300, 0, []
while not heard and time.monotonic() < deadline:
    try:
        taken = subscription.handle.take_message(Strings, False)
        heard += [taken[0]] if taken else []
    except RuntimeError:
        faults += 1
message = Strings()
message._string_value = 5
try:
    publisher.publish(message)
except TypeError:
    faults += 10
print(refused > 100, heard[0].string_value, faults)
"""


@pytest.mark.long
@pytest.mark.ros
def test_hostile_bytes_and_wrong_values_raise_in_python_and_kill_nothing(built: BuiltInterfaces) -> None:
    assert run(HOSTILE, built).split() == ["True", "after", "11"]


FORKED = """
import os
import rclpy
from test_msgs.msg import Strings
from rclpy.serialization import deserialize_message, serialize_message
serialize_message(Strings())
children = []
for n in range(2):
    child = os.fork()
    if not child:
        message = Strings(string_value=str(n))
        os._exit(0 if deserialize_message(serialize_message(message), Strings) == message else 1)
    children.append(child)
print([os.waitpid(child, 0)[1] for child in children])
"""


@pytest.mark.long
def test_works_in_processes_forked_after_its_first_use(built: BuiltInterfaces) -> None:
    assert run(FORKED, built).strip() == "[0, 0]"


def test_a_package_is_built_once_and_no_half_built_one_is_left(tmp_path: Path) -> None:
    package = InterfacePackage("mine", (DefinitionFile("msg", "Foo", "std_msgs/Header header\nint32 MAX=3\n"),))
    first = build([package], tmp_path, [SHARE])
    time_of = (first.python / "mine" / "msg" / "_foo.py").stat().st_mtime_ns
    assert build([package], tmp_path, [SHARE]) == first
    assert (first.python / "mine" / "msg" / "_foo.py").stat().st_mtime_ns == time_of
    assert [path.name for path in tmp_path.iterdir()] == [first.prefix.name]


def test_processes_that_build_the_same_at_once_agree(tmp_path: Path) -> None:
    (tmp_path / "mine" / "msg").mkdir(parents=True)
    (tmp_path / "mine" / "msg" / "Foo.msg").write_text("int32 a\n")
    text = f"""
from pathlib import Path
from grader.runtime.interfaces.build import build
from grader.runtime.interfaces.definitions import find_packages
print(build(find_packages(Path({str(tmp_path / "mine")!r})), Path({str(tmp_path / "cache")!r}), [Path({str(SHARE)!r})]))
"""
    env = {**os.environ, "PYTHONPATH": str(HERE.parents[1])}
    processes = [
        subprocess.Popen([sys.executable, "-c", text], env=env, stdout=subprocess.PIPE, text=True) for _ in range(3)
    ]
    printed = {process.communicate(timeout=600)[0] for process in processes}
    assert len(printed) == 1
    assert len(list((tmp_path / "cache").iterdir())) == 1


def test_packages_can_build_on_built_ones(tmp_path: Path) -> None:
    first = build([InterfacePackage("base", (DefinitionFile("msg", "Foo", "int32 a\n"),))], tmp_path, [SHARE])
    upper = InterfacePackage("upper", (DefinitionFile("msg", "Bar", "base/Foo[2] foos\n"),))
    copied = InterfacePackage("base", (DefinitionFile("msg", "Foo", "int64 other\n"),))
    second = build([upper, copied], tmp_path, [SHARE, first.share])
    assert second.names == ("upper",)
    printed = run("from upper.msg import Bar; print(Bar())", second, first)
    assert "foos=[base.msg.Foo(a=0), base.msg.Foo(a=0)]" in printed


@pytest.mark.parametrize(
    ("package", "definition", "problem"),
    [
        ("numpy", DefinitionFile("msg", "Foo", ""), "an installed Python module"),
        ("mine", DefinitionFile("msg", "Foo", "int32 builtins\nint32 b\n"), "Python cannot load it"),
    ],
)
def test_what_python_could_not_load_is_refused(
    tmp_path: Path, package: str, definition: DefinitionFile, problem: str
) -> None:
    with pytest.raises(DefinitionError, match=problem):
        build([InterfacePackage(package, (definition,))], tmp_path, [SHARE])
    assert list(tmp_path.iterdir()) == []


def test_an_installed_package_is_left_to_the_installation(tmp_path: Path) -> None:
    package = InterfacePackage("std_msgs", (DefinitionFile("msg", "String", "int32 a\n"),))
    assert build([package], tmp_path, [SHARE]).names == ()
