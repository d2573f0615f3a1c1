"""Ways in which people write (x, y) down, right and wrong; each writes one message from the fields of a pose."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable

Writer = Callable[[float, float], str | Iterable[str]]


def _comma(v: float, digits: int = 2) -> str:
    return f"{v:.{digits}f}".replace(".", ",")


def _unicode_minus(v: float) -> str:
    return f"{v:.3f}".replace("-", "\u2212")


RIGHT: dict[str, Writer] = {
    "chapter hint": lambda x, y: f"Position: x={x:.2f}, y={y:.2f}",
    "percent": lambda x, y: "Position: x=%.3f y=%.3f" % (x, y),  # noqa: UP031 - students write so
    "str.format": lambda x, y: "Robot is at ({:.1f}, {:.1f})".format(x, y),  # noqa: UP032, PLW0108 - students write so
    "bare numbers": lambda x, y: f"{x} {y}",
    "full repr": lambda x, y: f"x: {x}, y: {y}",
    "comma separated": lambda x, y: f"{x:.4f},{y:.4f}",
    "tuple": lambda x, y: str((x, y)),
    "list": lambda x, y: str([round(x, 2), round(y, 2)]),
    "labels before": lambda x, y: f"Position (x, y) = ({x:.2f}, {y:.2f})",
    "labels before, no brackets": lambda x, y: f"x, y: {x:.2f}, {y:.2f}",
    "labels before with z": lambda x, y: f"[x y z] = [{x:.3f} {y:.3f} 0.000]",
    "Point repr": lambda x, y: f"geometry_msgs.msg.Point(x={x}, y={y}, z=0.0)",
    "three records": lambda x, y: [f"x: {x:.2f}", f"y: {y:.2f}", "z: 0.00"],
    "two records, no labels": lambda x, y: [f"{x:.3f}", f"{y:.3f}"],
    "header and lines": lambda x, y: ["--- odometry 1 ---", f"  X = {x:.3f} m", f"  Y = {y:.3f} m"],
    "one record of three lines": lambda x, y: f"Position\n  x: {x:.2f}\n  y: {y:.2f}",
    "pos_x": lambda x, y: f"pos_x={x:.2f} pos_y={y:.2f}",
    "px py": lambda x, y: f"px {x:.2f} py {y:.2f}",
    "camel case": lambda x, y: f"posX: {x:.2f}; posY: {y:.2f}",
    "whole path": lambda x, y: f"pose.pose.position.x={x:.3f} pose.pose.position.y={y:.3f}",
    "glued labels": lambda x, y: f"x{x:.2f} y{y:.2f}",
    "glued units": lambda x, y: f"X: {x:.2f}m, Y: {y:.2f}m",
    "units in brackets": lambda x, y: f"x [m]: {x:.2f}, y [m]: {y:.2f}",
    "units in the list": lambda x, y: f"x [m], y [m]: {x:.2f}, {y:.2f}",
    "centimetres": lambda x, y: f"x={100 * x:.0f}cm y={100 * y:.0f}cm",
    "scientific": lambda x, y: f"x={x:.3e} y={y:.3e}",
    "plus signs": lambda x, y: f"({x:+.2f} | {y:+.2f})",
    "space for plus": lambda x, y: f"x={x: .2f} y={y: .2f}",
    "padded": lambda x, y: f"x={x:8.3f} y={y:8.3f}",
    "3f": lambda x, y: f"X: {x:3f} Y: {y:3f}",
    "numpy array": lambda x, y: f"pose [{x:11.8f} {y:11.8f}]",
    "cut off": lambda x, y: f"x={int(x * 100) / 100} y={int(y * 100) / 100}",
    "json": lambda x, y: json.dumps({"x": x, "y": y}),
    "json y first": lambda x, y: json.dumps({"y": y, "x": x}),
    "y before x": lambda x, y: f"y={y:.2f} x={x:.2f}",
    "labels y, x": lambda x, y: f"(y, x) = ({y:.2f}, {x:.2f})",
    "suffix labels": lambda x, y: f"{x:.2f} (x), {y:.2f} (y)",
    "suffix labels with z": lambda x, y: f"{x:.2f} x, {y:.2f} y, 0.00 z",
    "Spanish": lambda x, y: f"Posición del robot: x = {x:.2f} m y y = {y:.2f} m",
    "Spanish, and": lambda x, y: f"Posición {x:.2f} y {y:.2f}",
    "Spanish, received and": lambda x, y: f"Mensaje recibido y procesado en {x:.2f}, {y:.2f}",
    "Spanish axes": lambda x, y: f"El robot está en x e y: {x:.2f} y {y:.2f}",
    "French": lambda x, y: f"Les coordonnées x et y sont {x:.2f} et {y:.2f}",
    "German comma": lambda x, y: f"Position: x={_comma(x)} m, y={_comma(y)} m",
    "German comma, semicolon": lambda x, y: f"Ort ({_comma(x, 3)}; {_comma(y, 3)})",
    "German comma list": lambda x, y: f"Ort {_comma(x, 3)}, {_comma(y, 3)}",
    "Chinese": lambda x, y: f"机器人位置\uff1ax={x:.2f}\uff0cy={y:.2f}",
    "Chinese without labels": lambda x, y: f"当前位置\uff08{x:.3f}\uff0c{y:.3f}\uff09",
    "Chinese axes": lambda x, y: f"横坐标{x:.2f}纵坐标{y:.2f}",
    "Arabic": lambda x, y: f"الموقع: {x:.2f} ، {y:.2f}",
    "unicode minus": lambda x, y: f"({_unicode_minus(x)}, {_unicode_minus(y)})",
    "coloured": lambda x, y: f"\x1b[32mx={x:.2f}\x1b[0m \x1b[33my={y:.2f}\x1b[0m",
    "names with digits": lambda x, y: f"odom1 robot2: x1={x:.2f}, y1={y:.2f}",
    "counter before": lambda x, y: f"[{int(abs(x) * 1000)}] Position: {x:.2f}, {y:.2f}",
    "stamp before": lambda x, y: f"[1698765432.123] x: {x:.2f} y: {y:.2f} in the x-y plane",
    "date before": lambda x, y: f"2024-05-01 12:30:{abs(x):02.0f} {x:.3f} {y:.3f}",
    "heading after": lambda x, y: f"x={x:.2f}, y={y:.2f}, theta={x + y:.2f}",
    "list of three labels": lambda x, y: f"(x,y,yaw)=({x:.2f},{y:.2f},{x - y:.2f})",
    "velocity after": lambda x, y: f"Position: ({x:.2f}, {y:.2f}) velocity: x=0.35 y=0.00",
    "talks of x and y first": lambda x, y: f"Extracting x, y position. x: {x:.2f}, y: {y:.2f}",
    "sentence": lambda x, y: f"The x coordinate is {x:.2f} and the y coordinate is {y:.2f}.",
    "whole message": lambda x, y: (
        "nav_msgs.msg.Odometry(header=std_msgs.msg.Header(stamp=builtin_interfaces.msg.Time(sec=1700000012, "
        "nanosec=4000), frame_id='odom'), child_frame_id='base_link', pose=geometry_msgs.msg.PoseWithCovariance("
        f"pose=geometry_msgs.msg.Pose(position=geometry_msgs.msg.Point(x={x}, y={y}, z=0.0), orientation=geometry_msgs."
        "msg.Quaternion(x=0.0, y=0.0, z=0.1, w=0.99)), covariance=array([" + ", ".join(["0.01"] * 36) + "])), twist="
        "Twist(linear=Vector3(x=0.35, y=0.0, z=0.0), angular=Vector3(x=0.0, y=0.0, z=0.2)))"
    ),
    "list of labels and a time": lambda x, y: f"Position (x, y) at t=12.30: ({x:.2f}, {y:.2f})",
    "list of labels the other way and a time": lambda x, y: f"(y, x) of robot 7: {y:.2f}, {x:.2f}",
    "numbers after each label": lambda x, y: f"x of robot 2 is {x:.2f}, y of robot 2 is {y:.2f}",
    "message as YAML": lambda x, y: (
        f"pose:\n  position:\n    x: {x}\n    y: {y}\n    z: 0.0\n  orientation:\n    x: 0.0\n"
    ),
    "French, il y a": lambda x, y: f"il y a 3 messages : x = {x:.2f}, y = {y:.2f}",
    "arrow": lambda x, y: f"Robot -> {x:.2f} -> {y:.2f}",
    "semicolons": lambda x, y: f"X;Y;{x:.3f};{y:.3f}",
    "table": lambda x, y: f"| {x:>8.2f} | {y:>8.2f} |",
    "object address": lambda x, y: f"<Point object at 0x7f12ab34> {x:.3f} {y:.3f}",
    "changing words": lambda x, y: f"{'left' if x < 0 else 'right'} of the origin: {x:.2f}, {y:.2f}",
    "dots": lambda x, y: f"position...{x:.2f}...{y:.2f}",
    "an ellipsis": lambda x, y: f"x…{x:.3f} y…{y:.3f}",
    "lines of dots": lambda x, y: [f"x {x:.>12.3f}", f"y {y:.>12.3f}"],
    "dots and commas": lambda x, y: f"x...{_comma(x)} y...{_comma(y)}",
    "dashes": lambda x, y: f"x-{x:.2f} y-{y:.2f}",
    "names before numbers": lambda x, y: f"posx{100 * x:.0f}cm posy{100 * y:.0f}cm",
    "underscores": lambda x, y: f"x_{round(1000 * x)}mm y_{round(1000 * y)}mm",
    "complex": lambda x, y: f"{complex(x, y):.3f}",
    "decimetres": lambda x, y: f"x={10 * x:.1f} dm y={10 * y:.1f} dm",
    "kilometres": lambda x, y: f"x={x / 1000:.6f} km y={y / 1000:.6f} km",
    "centimetres in words": lambda x, y: f"x is {100 * x:.0f} centimeters, y is {100 * y:.0f} centimeters",
    "German centimetres": lambda x, y: f"x={_comma(100 * x)} Zentimeter, y={_comma(100 * y)} Zentimeter",
    "other record too": lambda x, y: [f"x={x:.2f} y={y:.2f}", f"speed 0.35 {x - y:.2f}"],
}

WRONG: dict[str, tuple[Writer, str]] = {
    "swapped": (lambda x, y: f"x={y:.2f}, y={x:.2f}", "swapped"),
    "swapped list": (lambda x, y: f"Position (x, y) = ({y:.2f}, {x:.2f})", "swapped"),
    "swapped without labels": (lambda x, y: f"{y:.3f} {x:.3f}", "swapped"),
    "labels lie in a list": (lambda x, y: f"(y, x) at t=12.30: ({x:.2f}, {y:.2f})", "swapped"),
    "labels lie": (lambda x, y: f"y={x:.2f}, x={y:.2f}", "swapped"),
    "only x": (lambda x, y: f"x={x:.2f}", "only_x"),
    "only y": (lambda x, y: f"position {y:.2f}", "only_y"),
    "x twice": (lambda x, y: f"x={x:.2f} y={x:.2f}", "only_x"),
    "sign of y": (lambda x, y: f"x={x:.2f}, y={-y:.2f}", "sign"),
    "both signs, glued": (lambda x, y: f"x{-x:.2f} y{-y:.2f}", "sign"),
    "lost signs after dashes": (lambda x, y: f"x-{abs(x):.2f} y-{abs(y):.2f}", "wrong"),
    "lost signs after dots": (lambda x, y: f"x...{abs(x):.2f} y...{abs(y):.2f}", "sign"),
    "both signs": (lambda x, y: f"({-x:.2f}, {-y:.2f})", "sign"),
    "lost signs": (lambda x, y: f"x={abs(x):.2f} y={abs(y):.2f}", "sign"),
    "constant": (lambda x, y: "x=0.00, y=0.00", "constant"),
    "x and z": (lambda x, y: f"x={x:.2f}, y={0.0:.2f}", "no_y"),
    "scaled": (lambda x, y: f"x={3 * x:.2f}, y={3 * y:.2f}", "wrong"),
    "nan": (lambda x, y: "x=nan, y=nan", "wrong"),
    "no number": (lambda x, y: "got odometry", "no_pair"),
}


def plain(x: float, y: float) -> str:
    """Write a position down as most people do."""
    return f"x={x:.2f} y={y:.2f}"
