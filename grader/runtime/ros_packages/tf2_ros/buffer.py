"""A buffer that waits for transforms, and tells them to others over a service."""

from __future__ import annotations

import contextlib
import time as clocks
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.clock import Clock
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.task import Future
from rclpy.time import Time
from tf2_msgs.srv import FrameGraph
from tf2_py import BufferCore, TransformException

from .buffer_interface import BufferInterface

__all__ = ["Buffer"]

#: How often a waiting call looks again, in seconds.
LOOK_S = 0.02


class Buffer(BufferCore, BufferInterface):
    """Keeps transforms, and looks them up.

    Args:
        cache_time: How long transforms are kept; 10 s if None.
        node: If given, a service `tf2_frames` of this node describes the frames.
    """

    def __init__(self, cache_time: Duration | None = None, node: Node | None = None) -> None:
        if cache_time is not None and not isinstance(cache_time, Duration):
            raise TypeError(f"cache_time must be a Duration, got {type(cache_time)}")
        BufferCore.__init__(self, cache_time)
        BufferInterface.__init__(self)
        self._waiting: list[Callable[[], None]] = []
        if node is not None:
            self.srv = node.create_service(FrameGraph, "tf2_frames", self._describe)

    def _describe(self, _: Any, response: Any) -> Any:
        response.frame_yaml = self.all_frames_as_yaml()
        return response

    def set_transform(self, transform: TransformStamped, authority: str) -> None:
        """Add a transform."""
        super().set_transform(transform, authority)
        self._look_again()

    def set_transform_static(self, transform: TransformStamped, authority: str) -> None:
        """Add a transform that holds for all times."""
        super().set_transform_static(transform, authority)
        self._look_again()

    def _look_again(self) -> None:
        for look in list(self._waiting):
            look()

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Time, timeout: Duration = Duration()
    ) -> TransformStamped:
        """Return the transform from the source frame to the target frame.

        Args:
            target_frame: Frame of the result.
            source_frame: Frame of the data.
            time: When; 0 is the latest time that is known.
            timeout: How long to wait for it. The wait blocks, so another thread has to spin the listener's node.
        """
        self.can_transform(target_frame, source_frame, time, timeout)
        return self.lookup_transform_core(target_frame, source_frame, time)

    async def lookup_transform_async(self, target_frame: str, source_frame: str, time: Time) -> TransformStamped:
        """Wait for a transform without blocking, and return it."""
        await self.wait_for_transform_async(target_frame, source_frame, time)
        return self.lookup_transform_core(target_frame, source_frame, time)

    def lookup_transform_full(
        self,
        target_frame: str,
        target_time: Time,
        source_frame: str,
        source_time: Time,
        fixed_frame: str,
        timeout: Duration = Duration(),
    ) -> TransformStamped:
        """Return the transform between two frames at two times, over a frame that does not move in between."""
        self.can_transform_full(target_frame, target_time, source_frame, source_time, fixed_frame, timeout)
        return self.lookup_transform_full_core(target_frame, target_time, source_frame, source_time, fixed_frame)

    async def lookup_transform_full_async(
        self, target_frame: str, target_time: Time, source_frame: str, source_time: Time, fixed_frame: str
    ) -> TransformStamped:
        """Wait for a transform between two times without blocking, and return it."""
        await self.wait_for_transform_full_async(target_frame, target_time, source_frame, source_time, fixed_frame)
        return self.lookup_transform_full_core(target_frame, target_time, source_frame, source_time, fixed_frame)

    def can_transform(
        self,
        target_frame: str,
        source_frame: str,
        time: Time,
        timeout: Duration = Duration(),
        return_debug_tuple: bool = False,
    ) -> Any:
        """Return whether a transform is available in time, or with `return_debug_tuple` also why not."""
        found = self._waited(lambda: self.can_transform_core(target_frame, source_frame, time), timeout)
        return found if return_debug_tuple else found[0]

    def can_transform_full(
        self,
        target_frame: str,
        target_time: Time,
        source_frame: str,
        source_time: Time,
        fixed_frame: str,
        timeout: Duration = Duration(),
        return_debug_tuple: bool = False,
    ) -> Any:
        """Return whether a transform between two times is available in time."""
        asked = (target_frame, target_time, source_frame, source_time, fixed_frame)
        found = self._waited(lambda: self.can_transform_full_core(*asked), timeout)
        return found if return_debug_tuple else found[0]

    def _waited(self, look: Callable[[], tuple[bool, str]], timeout: Duration) -> tuple[bool, str]:
        """Look until it is found, in the time of the system, also where a node follows a simulation."""
        clock = Clock()
        start, found = clock.now(), look()
        while not found[0] and start <= clock.now() < start + timeout:
            clocks.sleep(LOOK_S)
            found = look()
        return found

    def wait_for_transform_async(self, target_frame: str, source_frame: str, time: Time) -> Future:
        """Return a future that is done, with the transform as its result, once it is available."""
        return self._future(lambda: self.lookup_transform_core(target_frame, source_frame, time))

    def wait_for_transform_full_async(
        self, target_frame: str, target_time: Time, source_frame: str, source_time: Time, fixed_frame: str
    ) -> Future:
        """Return a future that is done once a transform between two times is available."""
        asked = (target_frame, target_time, source_frame, source_time, fixed_frame)
        return self._future(lambda: self.lookup_transform_full_core(*asked))

    def _future(self, look_up: Callable[[], TransformStamped]) -> Future:
        future: Future = Future()

        def look() -> None:
            if not future.done():
                with contextlib.suppress(TransformException):
                    future.set_result(look_up())

        def forget(_: Future) -> None:
            if look in self._waiting:
                self._waiting.remove(look)

        self._waiting.append(look)
        future.add_done_callback(forget)
        look()
        return future
