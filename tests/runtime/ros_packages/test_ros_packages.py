"""The Python packages of ROS that the grader lends: what their documentation promises, and programs that use them."""

from __future__ import annotations

import ast
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tiers import NIGHTLY, but, more

pytest.importorskip("rclpy")

from builtin_interfaces.msg import Time as Stamp
from geometry_msgs.msg import TransformStamped
from rclpy.clock import ClockType
from rclpy.duration import Duration
from rclpy.time import Time
from sensor_msgs.msg import Image, PointField
from std_msgs.msg import Header

from grader.grading.app.observe import ObserveRequest, observe_programs
from grader.grading.judging.installation import NOT_LENT
from grader.runtime.lending import LENDABLE, LENT, lent_to
from grader.runtime.model.quantities import NS_PER_S


@pytest.fixture(autouse=True, scope="module")
def lent() -> Iterator[None]:
    """Make the packages importable, as in a node."""
    sys.path.append(str(LENT))
    yield
    sys.path.remove(str(LENT))


# --- which programs get what ---


def test_only_what_a_program_names_is_lent_with_what_that_needs() -> None:
    """And nothing that is installed."""
    assert {folder.name for folder in LENT.iterdir() if (folder / "__init__.py").is_file()} == set(LENDABLE)
    assert lent_to((), lambda name: False).names == ()
    assert lent_to(["tf2_ros"], lambda name: False).names == ("tf2_py", "tf2_ros")
    assert b"tf2_msgs" in lent_to(["tf2_ros"], lambda name: False).text
    assert lent_to(["tf2_geometry_msgs"], lambda name: name == "tf2_py").names == ("tf2_geometry_msgs", "tf2_ros")
    assert lent_to(["cv_bridge"], lambda name: True).names == ()


def test_what_is_said_to_be_missing_is_missing() -> None:
    """It makes a criterion undecided, so a name that is there must not be listed."""
    for package, names in NOT_LENT.items():
        files = list((LENT / package).rglob("*.py"))
        defined = {
            node.name
            for path in files
            for node in ast.parse(path.read_text()).body
            if isinstance(node, (ast.FunctionDef, ast.ClassDef))
        }
        assert not {*defined, *(path.stem for path in files)} & {*names}
        assert defined or not names, package


# --- tf2_py ---


def transform(parent: str, child: str, t_s: float = 0, x: float = 0, yaw: float = 0) -> TransformStamped:
    found = TransformStamped(child_frame_id=child)
    found.header.frame_id = parent
    found.header.stamp = Stamp(sec=int(t_s), nanosec=round((t_s % 1) * 1e9))
    found.transform.translation.x = float(x)
    found.transform.rotation.z, found.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return found


def at(t_s: float) -> Time:
    return Time(nanoseconds=round(t_s * NS_PER_S), clock_type=ClockType.ROS_TIME)


def filled(*transforms: TransformStamped, **options: Any) -> Any:
    from tf2_py import BufferCore

    buffer = BufferCore(**options)
    for one in transforms:
        buffer.set_transform(one, "test")
    return buffer


def x_of(found: TransformStamped) -> float:
    return float(found.transform.translation.x)


def test_a_chain_is_multiplied_and_turned() -> None:
    """The laser is a metre ahead of a base that looks to the left."""
    buffer = filled(transform("odom", "base", 1, x=2, yaw=math.pi / 2), transform("base", "laser", 1, x=1))
    found = buffer.lookup_transform_core("odom", "laser", at(1))
    shift, turn = found.transform.translation, found.transform.rotation
    assert [shift.x, shift.y, shift.z] == pytest.approx([2, 1, 0])
    assert [turn.z, turn.w] == pytest.approx([math.sqrt(0.5)] * 2)
    assert (found.header.frame_id, found.child_frame_id, found.header.stamp.sec) == ("odom", "laser", 1)
    back = buffer.lookup_transform_core("laser", "odom", at(1)).transform.translation
    assert [back.x, back.y] == pytest.approx([-1, 2])


def test_between_two_samples_it_is_interpolated() -> None:
    """Linearly, and along the shortest rotation."""
    buffer = filled(transform("odom", "base", 1), transform("odom", "base", 2, x=1, yaw=math.pi / 2))
    found = buffer.lookup_transform_core("odom", "base", at(1.25))
    assert x_of(found) == pytest.approx(0.25)
    assert 2 * math.atan2(found.transform.rotation.z, found.transform.rotation.w) == pytest.approx(math.pi / 8)


def test_zero_is_the_latest_common_time() -> None:
    """Of the frames in between; static ones are known at all times."""
    buffer = filled(transform("odom", "base", 1, x=1), transform("odom", "base", 3, x=3), transform("base", "arm", 2))
    buffer.set_transform_static(transform("arm", "hand", x=10), "test")
    found = buffer.lookup_transform_core("odom", "hand", Time())
    assert (x_of(found), found.header.stamp.sec) == (pytest.approx(12), 2)
    assert buffer.get_latest_common_time("odom", "hand").nanoseconds == 2 * NS_PER_S
    assert buffer.get_latest_common_time("arm", "hand").nanoseconds == 0


@pytest.mark.parametrize(
    ("target", "source", "t_s", "error", "said"),
    [
        ("map", "base", 1, "LookupException", '"map" passed to lookupTransform argument target_frame does not exist'),
        ("odom", "cam", 1, "LookupException", '"cam" passed to lookupTransform argument source_frame does not exist'),
        ("odom", "other", 1, "ConnectivityException", "'odom' and 'other'"),
        ("odom", "base", 5, "ExtrapolationException", "into the future.  Requested time 5.000000"),
        ("odom", "base", 0.5, "ExtrapolationException", "into the past.  Requested time 0.500000"),
        ("world", "other", 5, "ExtrapolationException", "only time 1.000000 is in the buffer"),
        ("", "base", 1, "InvalidArgumentException", "cannot be empty"),
        ("/odom", "base", 1, "InvalidArgumentException", "cannot start with a '/'"),
    ],
)
def test_what_is_not_known_raises(target: str, source: str, t_s: float, error: str, said: str) -> None:
    """Each by its own exception, all of which are TransformExceptions; `can_transform` says the same."""
    import tf2_py

    buffer = filled(transform("odom", "base", 1), transform("odom", "base", 2), transform("world", "other", 1))
    with pytest.raises(getattr(tf2_py, error)) as raised:
        buffer.lookup_transform_core(target, source, at(t_s))
    assert said in str(raised.value)
    assert isinstance(raised.value, tf2_py.TransformException)
    possible, why = buffer.can_transform_core(target, source, at(t_s))
    assert not possible
    if error in ("LookupException", "InvalidArgumentException"):
        argument = "source" if source == "cam" else "target"
        assert f"passed to canTransform argument {argument}_frame - " in why
    else:
        assert why == str(raised.value)


def test_old_samples_are_forgotten() -> None:
    """Ten seconds, or as long as the buffer is told."""
    times = [transform("odom", "base", t, x=t) for t in range(1, 20)]
    assert not filled(*times).can_transform_core("odom", "base", at(8.5))[0]
    assert filled(*times, cache_time=Duration(seconds=15)).can_transform_core("odom", "base", at(8.5))[0]


def test_what_makes_no_sense_is_left_out(capfd: pytest.CaptureFixture[str]) -> None:
    """With a line on stderr: the commonest is a rotation that was never set to w = 1."""
    zero = transform("odom", "base", 1)
    zero.transform.rotation.w = 0.0
    nan = transform("odom", "base", 1, x=math.nan)
    buffer = filled(zero, nan, transform("base", "base"), transform("", "base"), transform("odom", ""))
    assert buffer.all_frames_as_string() == ""
    told = capfd.readouterr().err.splitlines()
    assert [line.split()[1] for line in told] == [
        "TF_DENORMALIZED_QUATERNION:",
        "TF_NAN_INPUT:",
        "TF_SELF_TRANSFORM:",
        "TF_NO_FRAME_ID:",
        "TF_NO_CHILD_FRAME_ID:",
    ]


def test_a_frame_is_itself_whether_it_exists_or_not() -> None:
    """At the time that is asked for, or the latest of the frame."""
    buffer = filled(transform("odom", "base", 3, x=1))
    assert buffer.can_transform_core("base", "base", at(9)) == (True, "")
    assert buffer.lookup_transform_core("base", "base", Time()).header.stamp.sec == 3
    found = buffer.lookup_transform_core("nowhere", "nowhere", at(9))
    assert (x_of(found), found.transform.rotation.w, found.header.stamp.sec) == (0, 1, 9)


def test_between_two_times_a_fixed_frame_helps() -> None:
    """Where the base was, seen from where it is now."""
    buffer = filled(transform("odom", "base", 1, x=1), transform("odom", "base", 2, x=4))
    found = buffer.lookup_transform_full_core("base", at(2), "base", at(1), "odom")
    assert x_of(found) == pytest.approx(-3)


# --- tf_transformations ---


angles = st.floats(-1.5, 1.5)


@given(angles, angles, angles)
def test_euler_angles_and_quaternions_agree(roll: float, pitch: float, yaw: float) -> None:
    """There and back, also over a matrix; a quaternion is x, y, z, w."""
    import tf_transformations as tf

    q = tf.quaternion_from_euler(roll, pitch, yaw)
    assert tf.euler_from_quaternion(q) == pytest.approx((roll, pitch, yaw), abs=1e-6)
    assert np.allclose(tf.quaternion_matrix(q), tf.euler_matrix(roll, pitch, yaw))
    about = tf.quaternion_multiply(
        tf.quaternion_about_axis(yaw, (0, 0, 1)),
        tf.quaternion_multiply(tf.quaternion_about_axis(pitch, (0, 1, 0)), tf.quaternion_about_axis(roll, (1, 0, 0))),
    )
    assert np.allclose(np.abs(np.dot(q, about)), 1)
    assert np.allclose(tf.quaternion_multiply(q, tf.quaternion_inverse(q)), [0, 0, 0, 1])


def test_matrices_do_what_their_names_say() -> None:
    """Points are columns with a 1 at the end."""
    import tf_transformations as tf

    point = np.array([1.0, 2.0, 3.0, 1.0])
    assert np.allclose(tf.translation_matrix([1, 1, 1]) @ point, [2, 3, 4, 1])
    assert np.allclose(tf.rotation_matrix(math.pi / 2, [0, 0, 1]) @ point, [-2, 1, 3, 1])
    assert np.allclose(tf.rotation_matrix(math.pi, [0, 0, 1], [1, 0, 0]) @ point, [1, -2, 3, 1])
    assert np.allclose(tf.scale_matrix(2) @ point, [2, 4, 6, 1])
    assert np.allclose(tf.reflection_matrix([0, 0, 0], [1, 0, 0]) @ point, [-1, 2, 3, 1])
    whole = tf.concatenate_matrices(tf.translation_matrix([1, 0, 0]), tf.rotation_matrix(0.3, [0, 0, 1]))
    assert np.allclose(tf.inverse_matrix(whole) @ whole, tf.identity_matrix())
    assert tf.is_same_transform(whole, tf.compose_matrix(angles=(0, 0, 0.3), translate=(1, 0, 0)))
    assert tf.decompose_matrix(whole)[2] == pytest.approx((0, 0, 0.3))
    angle, axis, _ = tf.rotation_from_matrix(tf.rotation_matrix(0.4, [0, 1, 0]))
    assert angle * axis[1] == pytest.approx(0.4)
    halfway = tf.quaternion_slerp(tf.quaternion_from_euler(0, 0, 0), tf.quaternion_from_euler(0, 0, 1), 0.5)
    assert tf.euler_from_quaternion(halfway)[2] == pytest.approx(0.5)
    assert tf.vector_norm([3, 4]) == pytest.approx(5)
    assert np.allclose(tf.unit_vector([0, 2, 0]), [0, 1, 0])


@given(angles, angles, angles)
def test_roll_pitch_and_yaw_turn_about_fixed_axes_in_this_order(roll: float, pitch: float, yaw: float) -> None:
    """By the matrices of textbooks: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    import tf_transformations as tf

    (cx, sx), (cy, sy), (cz, sz) = ((math.cos(a), math.sin(a)) for a in (roll, pitch, yaw))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    assert np.allclose(tf.euler_matrix(roll, pitch, yaw)[:3, :3], about_z @ about_y @ about_x)
    turning = tf.euler_matrix(roll, pitch, yaw, "rxyz")[:3, :3]
    assert np.allclose(turning, about_x @ about_y @ about_z)


def test_quaternions_multiply_as_hamiltons() -> None:
    """I j = k, with the parts in the order of ROS: x, y, z, w."""
    import tf_transformations as tf

    i, j, k = np.eye(4)[:3]
    assert np.allclose(tf.quaternion_multiply(i, j), k)
    assert np.allclose(tf.quaternion_multiply(j, i), -k)
    assert np.allclose(tf.quaternion_multiply(i, i), [0, 0, 0, -1])
    assert np.allclose(tf.quaternion_conjugate([1, 2, 3, 4]), [-1, -2, -3, 4])
    assert np.allclose(tf.quaternion_about_axis(1.0, [0, 0, 5]), [0, 0, math.sin(0.5), math.cos(0.5)])


@given(st.floats(-3, 3), st.tuples(angles, angles, angles).filter(lambda axis: math.hypot(*axis) > 0.1))
def test_an_axis_and_an_angle_give_rodrigues_matrix(angle: float, axis: tuple[float, float, float]) -> None:
    """R = I + sin(a) K + (1 - cos(a)) K K."""
    import tf_transformations as tf

    x, y, z = np.array(axis) / math.hypot(*axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    wanted = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    assert np.allclose(tf.rotation_matrix(angle, axis)[:3, :3], wanted)
    assert np.allclose(tf.quaternion_matrix(tf.quaternion_about_axis(angle, axis))[:3, :3], wanted)


@given(
    st.lists(st.tuples(st.booleans(), angles, angles, angles, angles), min_size=2, max_size=6),
    st.floats(0, 1),
    st.integers(0, 6),
)
def test_any_chain_is_the_product_of_its_matrices(
    links: list[tuple[bool, float, float, float, float]], share: float, middle: int
) -> None:
    """Static and moving frames, between two samples, from any frame of the chain to its end and back."""
    import tf_transformations as tf

    buffer, whole = filled(), []
    for number, (static, x, y, first, second) in enumerate(links):
        for t_s, yaw, far in ((10, first, x), (20, second, y)):
            found = transform(f"f{number}", f"f{number + 1}", t_s, x=far, yaw=yaw)
            (buffer.set_transform_static if static else buffer.set_transform)(found, "test")
        part = 1.0 if static else share
        whole.append(
            tf.concatenate_matrices(
                tf.translation_matrix([x + part * (y - x), 0, 0]),
                tf.rotation_matrix(first + part * (second - first), [0, 0, 1]),
            )
        )
    begin, end = f"f{min(middle, len(links) - 1)}", f"f{len(links)}"
    wanted = tf.concatenate_matrices(*whole[min(middle, len(links) - 1) :])
    when = Time(nanoseconds=10 * NS_PER_S + round(share * 10 * NS_PER_S), clock_type=ClockType.ROS_TIME)
    for parent, child, matrix in ((begin, end, wanted), (end, begin, np.linalg.inv(wanted))):
        found = buffer.lookup_transform_core(parent, child, when).transform
        turn, shift = found.rotation, found.translation
        got = tf.quaternion_matrix([turn.x, turn.y, turn.z, turn.w])
        got[:3, 3] = shift.x, shift.y, shift.z
        assert np.allclose(got, matrix, atol=1e-6)


# --- sensor_msgs_py ---


def test_points_come_back_as_they_were_put_in() -> None:
    """As structured arrays, plain arrays and tuples."""
    from sensor_msgs_py import point_cloud2

    points = [[1.0, 2.0, 3.0], [4.0, 5.0, math.nan]]
    cloud = point_cloud2.create_cloud_xyz32(Header(frame_id="laser"), points)
    assert (cloud.height, cloud.width, cloud.point_step, cloud.row_step) == (1, 2, 12, 24)
    assert point_cloud2.read_points(cloud)["y"].tolist() == [2.0, 5.0]
    assert point_cloud2.read_points_list(cloud, skip_nans=True)[0]._asdict() == {"x": 1.0, "y": 2.0, "z": 3.0}
    assert len(point_cloud2.read_points_list(cloud, skip_nans=True)) == 1
    assert point_cloud2.read_points_numpy(cloud, field_names=("x", "y")).tolist() == [[1, 2], [4, 5]]
    assert point_cloud2.read_points_numpy(cloud, uvs=[1])[0, 0] == 4


def test_fields_may_have_gaps_counts_and_types() -> None:
    """Numbered names for a field with a count, and an organised cloud keeps its rows."""
    from sensor_msgs_py import point_cloud2

    fields = [
        PointField(name="x", offset=0, datatype=PointField.FLOAT32, count=1),
        PointField(name="rgb", offset=8, datatype=PointField.UINT8, count=3),
    ]
    layout = point_cloud2.dtype_from_fields(fields, point_step=16)
    assert (layout.names, layout.itemsize) == (("x", "rgb_0", "rgb_1", "rgb_2"), 16)
    points = np.zeros((2, 3), dtype=layout)
    points["x"] = [[0, 1, 2], [3, 4, 5]]
    cloud = point_cloud2.create_cloud(Header(), fields, points, step=16)
    assert (cloud.height, cloud.width) == (2, 3)
    assert point_cloud2.read_points(cloud, reshape_organized_cloud=True)["x"][1, 2] == 5
    with pytest.raises(AssertionError, match="same datatype"):
        point_cloud2.read_points_numpy(cloud)


# --- cv_bridge ---


def test_an_image_comes_back_as_it_was() -> None:
    """With its encoding, or in another one."""
    from cv_bridge import CvBridge

    bridge = CvBridge()
    blue = np.zeros((2, 3, 3), dtype=np.uint8)
    blue[:, :, 0] = 255
    message = bridge.cv2_to_imgmsg(blue, "bgr8", Header(frame_id="camera"))
    assert (message.height, message.width, message.step, message.encoding) == (2, 3, 9, "bgr8")
    assert message.header.frame_id == "camera"
    assert np.array_equal(bridge.imgmsg_to_cv2(message), blue)
    assert bridge.imgmsg_to_cv2(message, "rgb8")[0, 0].tolist() == [0, 0, 255]
    assert bridge.imgmsg_to_cv2(message, "mono8")[0, 0] == 29  # 0.114 of 255
    assert bridge.imgmsg_to_cv2(message, "bgra8")[0, 0].tolist() == [255, 0, 0, 255]
    assert bridge.imgmsg_to_cv2(message, "rgb16")[0, 0].tolist() == [0, 0, 65535]
    depth = np.array([[1.5, math.inf]], dtype=np.float32)
    assert bridge.cv2_to_imgmsg(depth).encoding == "32FC1"
    assert np.array_equal(bridge.imgmsg_to_cv2(bridge.cv2_to_imgmsg(depth, "32FC1"), "32FC1"), depth)
    assert bridge.encoding_to_cvtype2("bgr8") == 16


def test_images_that_do_not_fit_are_refused() -> None:
    """A wrong type, a wrong conversion, too few bytes."""
    from cv_bridge import CvBridge, CvBridgeError

    bridge = CvBridge()
    with pytest.raises(CvBridgeError, match="incompatible type 8UC1"):
        bridge.cv2_to_imgmsg(np.zeros((2, 2), dtype=np.uint8), "bgr8")
    with pytest.raises(TypeError, match="not a numpy array"):
        bridge.cv2_to_imgmsg([[0]])  # type: ignore[arg-type]
    with pytest.raises(CvBridgeError, match="not a color format"):
        bridge.imgmsg_to_cv2(bridge.cv2_to_imgmsg(np.zeros((2, 2), dtype=np.float32)), "bgr8")
    with pytest.raises(CvBridgeError, match="Unrecognized image encoding"):
        bridge.imgmsg_to_cv2(Image(encoding="nonsense"))
    with pytest.raises(CvBridgeError, match="wrongly formed"):
        bridge.imgmsg_to_cv2(Image(encoding="mono8", height=2, width=2, step=2, data=[0, 0, 0]))


# --- message_filters ---


def stamped(t_ms: int) -> Any:
    found = Header()
    found.stamp = Stamp(sec=t_ms // 1000, nanosec=t_ms % 1000 * 1_000_000)
    return type("Message", (), {"header": found, "t": t_ms, "__repr__": lambda self: str(self.t)})()


def synchronised(make: Callable[[list[Any]], Any], *sent: tuple[int, int]) -> list[list[int]]:
    """Return the groups of stamps that pass, of messages sent as (filter, stamp in ms)."""
    from message_filters import SimpleFilter

    filters = [SimpleFilter() for _ in range(1 + max(number for number, _ in sent))]
    passed: list[list[int]] = []
    make(filters).registerCallback(lambda *messages: passed.append([m.t for m in messages]))
    for number, t_ms in sent:
        filters[number].signalMessage(stamped(t_ms))
    return passed


def test_equal_stamps_belong_together() -> None:
    """In whatever order they come; of a full queue, the oldest is dropped."""
    from message_filters import TimeSynchronizer

    def make(filters: list[Any]) -> Any:
        return TimeSynchronizer(filters, 2)

    assert synchronised(make, (0, 10), (0, 20), (1, 20), (1, 10)) == [[20, 20], [10, 10]]
    assert synchronised(make, (0, 10), (0, 20), (0, 30), (1, 10), (1, 20)) == [[20, 20]]
    assert synchronised(make, (0, 10), (1, 11)) == []


def test_near_stamps_belong_together() -> None:
    """The nearest within the slop, each message once."""
    from message_filters import ApproximateTimeSynchronizer

    def make(filters: list[Any]) -> Any:
        return ApproximateTimeSynchronizer(filters, 10, 0.05)

    assert synchronised(make, (0, 100), (1, 140)) == [[100, 140]]
    assert synchronised(make, (0, 100), (1, 149)) == [[100, 149]]
    assert synchronised(make, (0, 100), (1, 150)) == []
    assert synchronised(make, (0, 100), (0, 130), (1, 135)) == [[130, 135]]
    assert synchronised(make, (0, 100), (1, 100), (1, 101)) == [[100, 100]]
    assert synchronised(make, (0, 100), (1, 60), (2, 140), (1, 120)) == [[100, 120, 140]]


def test_a_cache_finds_messages_by_time() -> None:
    """Both ends of an interval are in it."""
    from message_filters import Cache, SimpleFilter

    source = SimpleFilter()
    cache = Cache(source, 3)
    assert (cache.getLast(), cache.getOldestTime()) == (None, None)
    for t_ms in (100, 200, 300, 400):
        source.signalMessage(stamped(t_ms))
    assert [m.t for m in cache.getInterval(at(0.2), at(0.3))] == [200, 300]
    assert cache.getElemBeforeTime(at(0.35)).t == 300
    assert cache.getElemAfterTime(at(0.35)).t == 400
    assert [m.t for m in cache.getSurroundingInterval(at(0.25), at(0.26))] == [200, 300]
    assert (cache.getLast().t, cache.getLatestTime()) == (400, at(0.4))


# --- in nodes ---


HEAD = """
import rclpy
from rclpy.clock import ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
from geometry_msgs.msg import PointStamped, TransformStamped, PoseStamped
rclpy.init()
node = rclpy.create_node('n')
left = [LOGS]

def log(text):
    node.get_logger().info(text)
    left[0] -= 1
    if not left[0]:
        rclpy.shutdown()
        raise SystemExit

def frame(parent, child, x=0.0, stamp=None):
    t = TransformStamped(child_frame_id=child)
    t.header.frame_id = parent
    t.header.stamp = stamp or node.get_clock().now().to_msg()
    t.transform.translation.x = x
    t.transform.rotation.w = 1.0
    return t
"""
TF = """
from tf2_ros import Buffer, TransformBroadcaster, StaticTransformBroadcaster, TransformListener, TransformException
buffer = Buffer()
"""
PROGRAMS = {
    "listener": (
        TF
        + "listener = TransformListener(buffer, node)\nsend = TransformBroadcaster(node)\n"
        + "both = lambda: [frame('odom', 'base', 1.0), frame('base', 'cam', 2.0)]\n"
        + "node.create_timer(0.1, lambda: send.sendTransform(both()))\n"
        + "look = lambda: buffer.lookup_transform('odom', 'cam', Time()).transform.translation.x\n"
        + "node.create_timer(0.55, lambda: log(str(look())))\nrclpy.spin(node)",
        ["3.0"],
    ),
    "thread": (
        TF
        + "other = rclpy.create_node('sender')\nlistener = TransformListener(buffer, node, spin_thread=True)\n"
        + "StaticTransformBroadcaster(other).sendTransform(frame('a', 'b', 4.0))\n"
        + "log(str(buffer.lookup_transform('a', 'b', Time(), timeout=Duration(seconds=1)).transform.translation.x))",
        ["4.0"],
    ),
    "timeout": (
        TF
        + "listener = TransformListener(buffer, node, spin_thread=True)\nstart = node.get_clock().now()\n"
        + "print(buffer.can_transform('a', 'b', Time(), timeout=Duration(seconds=0.5)))\n"
        + "log(f'{(node.get_clock().now() - start).nanoseconds / 1e9:.1f}')",
        ["0.5"],
    ),
    "async": (
        TF
        + "listener = TransformListener(buffer, node)\nsend = TransformBroadcaster(node)\n"
        + "async def look():\n    timer.cancel()\n    found = await buffer.lookup_transform_async('a', 'b', Time())\n"
        + "    log(str(found.transform.translation.x))\n"
        + "from rclpy.callback_groups import ReentrantCallbackGroup\n"
        + "timer = node.create_timer(0.1, look, callback_group=ReentrantCallbackGroup())\n"
        + "later = node.create_timer(0.5, lambda: (later.cancel(), send.sendTransform(frame('a', 'b', 5.0))))\n"
        + "rclpy.spin(node)",
        ["5.0"],
    ),
    "static": (
        TF
        + "send = StaticTransformBroadcaster(node)\n"
        + "send.sendTransform(frame('a', 'b', 1.0))\nsend.sendTransform(frame('b', 'c', 1.0))\n"
        + "late = TransformListener(buffer, node)\n"
        + "look = lambda: buffer.lookup_transform('a', 'c', Time()).transform.translation.x\n"
        + "node.create_timer(0.5, lambda: log(str(look())))\n"
        + "rclpy.spin_once(node)\nrclpy.spin_once(node)\nrclpy.spin_once(node)",
        ["2.0"],
    ),
    "point": (
        TF
        + "import tf2_geometry_msgs\nbuffer.set_transform_static(frame('odom', 'cam', 3.0), 'me')\n"
        + "p = PointStamped()\np.header.frame_id = 'cam'\np.point.x = 1.0\n"
        + "log(str(buffer.transform(p, 'odom').point.x))\n"
        + "q = PoseStamped()\nq.header.frame_id = 'cam'\nq.pose.orientation.w = 1.0\n"
        + "log(str(buffer.transform(q, 'odom').pose.position.x))",
        ["4.0", "3.0"],
    ),
    "submodules": (
        "from tf2_ros.buffer import Buffer\nfrom tf2_ros.transform_listener import TransformListener\n"
        "from tf2_ros.transform_broadcaster import TransformBroadcaster\n"
        "from tf2_ros.static_transform_broadcaster import StaticTransformBroadcaster\n"
        "from tf2_ros import LookupException\n"
        "from tf2_ros import Duration, Node, TFMessage, Time, TransformStamped\n"
        "try:\n    Buffer().lookup_transform('a', 'b', Time())\nexcept LookupException as error:\n    log(str(error))",
        ['"a" passed to lookupTransform argument target_frame does not exist. '],
    ),
    "angles": (
        "from tf_transformations import euler_from_quaternion, quaternion_from_euler\n"
        "log(' '.join(f'{a:.2f}' for a in euler_from_quaternion(quaternion_from_euler(0.1, 0.2, 0.3))))",
        ["0.10 0.20 0.30"],
    ),
    "filters": (
        "from message_filters import ApproximateTimeSynchronizer, Subscriber\n"
        "ends = [Subscriber(node, PointStamped, name) for name in 'ab']\n"
        "both = ApproximateTimeSynchronizer(ends, 10, 0.1)\n"
        "both.registerCallback(lambda a, b: log(f'{a.point.x} {b.point.x}'))\n"
        "pubs = [node.create_publisher(PointStamped, name, 10) for name in 'ab']\n"
        "def tick():\n"
        "    for number, pub in enumerate(pubs):\n"
        "        m = PointStamped()\n        m.header.stamp = node.get_clock().now().to_msg()\n"
        "        m.point.x = float(number)\n        pub.publish(m)\n"
        "node.create_timer(0.6, tick)\nrclpy.spin(node)",
        ["0.0 1.0"],
    ),
    "cloud": (
        "from sensor_msgs_py import point_cloud2 as pc2\nfrom std_msgs.msg import Header\n"
        "cloud = pc2.create_cloud_xyz32(Header(), [(1, 2, 3), (4, 5, 6)])\n"
        "log(str([tuple(p) for p in pc2.read_points(cloud, field_names=('x', 'z'))]).replace('np.float32', ''))",
        ["[((1.0), (3.0)), ((4.0), (6.0))]", "[(1.0, 3.0), (4.0, 6.0)]"],
    ),
    "image": (
        "from cv_bridge import CvBridge\nimport numpy as np\n"
        "m = CvBridge().cv2_to_imgmsg(np.full((2, 2, 3), 7, dtype=np.uint8), encoding='bgr8')\n"
        "log(f\"{m.encoding} {CvBridge().imgmsg_to_cv2(m, 'mono8').tolist()}\")",
        ["bgr8 [[7, 7], [7, 7]]"],
    ),
}


@pytest.mark.breadth(1, 3)
@pytest.mark.ros
@pytest.mark.parametrize("clock", ["virtual", *more(["wall"], NIGHTLY)])
@pytest.mark.parametrize(
    ("program", "logged"), but([PROGRAMS["listener"], PROGRAMS["filters"]], PROGRAMS.values()), ids=PROGRAMS
)
def test_programs_use_them(tmp_path: Path, program: str, logged: list[str], clock: str) -> None:
    """As where ROS brings them, on both clocks."""
    file = tmp_path / "node.py"
    logs = 2 if program is PROGRAMS["point"][0] else 1
    file.write_text(HEAD.replace("LOGS", str(logs)) + program)
    summary = observe_programs(ObserveRequest((file,), 60 * NS_PER_S, clock=clock), lambda _: None)
    assert [fault.text for fault in summary.faults if fault.exit_code != 0] == []
    texts = [record.text for record in summary.records]
    assert texts == logged or (len(texts) == 1 and texts[0] in logged), (texts, summary.lines)
