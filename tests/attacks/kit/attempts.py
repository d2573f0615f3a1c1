"""What the attacking nodes share: a velocity publisher as exercise 1 asks for it, which also tries forbidden things.

An attempt that returns something true has escaped; one that raises or returns something false was held back. The first
log record tells how many attempts there were and which of them escaped.
"""

import ctypes
import os
import platform
import re

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node

if os.getuid() == 0:
    raise SystemExit("these attacks are for a sandbox: as root outside of one they would harm the machine")

CANARY = re.compile(rb"canary-[0-9a-f]{32}")
# Numbers of system calls on x86-64 and aarch64.
CALLS = {
    "add_key": (248, 217),
    "bpf": (321, 280),
    "clone3": (435, 435),
    "fork": (57, None),
    "fsopen": (430, 430),
    "inotify_init": (253, None),
    "inotify_init1": (294, 26),
    "io_setup": (206, 0),
    "io_uring_setup": (425, 425),
    "keyctl": (250, 219),
    "landlock_create_ruleset": (444, 444),
    "msgget": (68, 186),
    "open_tree": (428, 428),
    "perf_event_open": (298, 241),
    "pidfd_open": (434, 434),
    "pidfd_getfd": (438, 438),
    "process_vm_readv": (310, 270),
    "process_vm_writev": (311, 271),
    "request_key": (249, 218),
    "semget": (64, 190),
    "setns": (308, 268),
    "shmget": (29, 194),
    "timer_create": (222, 107),
    "unshare": (272, 97),
    "userfaultfd": (323, 282),
    "vmsplice": (278, 75),
}
LIBC = ctypes.CDLL(None, use_errno=True)
FIRST, LATER, EVERY_TICK = [], [], []
TICKS_BEFORE_LATER = 5


def attempt(function):
    """Try something before the node starts to work."""
    FIRST.append(function)
    return function


def later(function):
    """Try something with the running node, when others have been discovered."""
    LATER.append(function)
    return function


def every_tick(function):
    """Do something with the running node after each command; no attempt by itself."""
    EVERY_TICK.append(function)
    return function


def call(name, *arguments):
    """Make a system call by its number and return what it returns, or raise the error."""
    number = CALLS[name][0 if platform.machine() == "x86_64" else 1]
    if number is None:
        raise OSError(f"no {name} on this machine")
    return checked(LIBC.syscall(ctypes.c_long(number), *(ctypes.c_long(argument) for argument in arguments)))


def checked(result):
    """Return the result of a C function, or raise its error."""
    if result < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return result


def opens(path):
    """Return whether a file can be read; tell what it holds."""
    with open(path, "rb") as file:
        tell(file.read(4096))
    return True


def holds_canary(data):
    """Return whether the instructor's secret is among the data, and tell it to whoever reads the output."""
    tell(data)
    return bool(CANARY.search(data))


def tell(data):
    """Print the secrets found in some data."""
    for found in CANARY.findall(data):
        print("found", found.decode(), flush=True)


def address(room):
    """Return where a writable buffer is in memory."""
    return ctypes.addressof(ctypes.c_char.from_buffer(room))


def spawn(work):
    """Start a process without Python's own fork, which the grader could have changed; return its number."""
    child = checked(LIBC.fork())
    if child == 0:
        try:
            work()
        finally:
            LIBC._exit(0)
    return child


class VelocityPublisher(Node):
    """The honest part."""

    def __init__(self, rate_hz, speed):
        super().__init__("velocity_publisher")
        self.speed = speed
        self.ticks = 0
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.escaped = self.try_all(FIRST)
        if not LATER:
            self.tell_all()
        self.create_timer(1 / rate_hz, self.tick)

    def try_all(self, attempts):
        results = [(attempt.__name__, self.result(attempt)) for attempt in attempts]
        return [f"{name} ({str(result)[:60]})" for name, result in results if result]

    def result(self, attempt):
        try:
            return attempt(self)
        except Exception as error:  # held back, in whatever way
            print(f"{attempt.__name__}: {type(error).__name__}: {error}", flush=True)
            return None

    def tick(self):
        command = Twist()
        command.linear.x = self.speed
        self.publisher.publish(command)
        self.ticks += 1
        if LATER and self.ticks == TICKS_BEFORE_LATER:
            self.escaped += self.try_all(LATER)
            self.tell_all()
        for function in EVERY_TICK:
            function(self)

    def tell_all(self):
        count = len(FIRST) + len(LATER)
        self.get_logger().info(f"{count} attempts, escaped: {', '.join(self.escaped) or 'none'}")


def run(rate_hz=20, speed=0.5):
    """Run the node; a rate of 20 Hz and a speed of 0.5 m/s are what the exercise asks for."""
    rclpy.init()
    rclpy.spin(VelocityPublisher(rate_hz, speed))
