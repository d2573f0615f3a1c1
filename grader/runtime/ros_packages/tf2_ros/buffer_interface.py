"""What all buffers offer, and the functions that transform and convert stamped data, by its type."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from typing import Any, ClassVar

from rclpy.duration import Duration
from rclpy.time import Time
from tf2_py import TransformException

__all__ = [
    "BufferInterface",
    "ConvertRegistration",
    "NotImplementedException",
    "TransformRegistration",
    "TypeException",
    "convert",
]


class TypeException(TransformException):
    """No function is registered for a type."""


class NotImplementedException(TransformException):
    """A buffer does not offer an operation."""


class TransformRegistration:
    """The functions that transform data, by its type: function(data, transform) -> data."""

    _functions: ClassVar[dict[type, Callable[[Any, Any], Any]]] = {}

    def add(self, key: type, callback: Callable[[Any, Any], Any]) -> None:
        """Register a function for a type."""
        self._functions[key] = callback

    def get(self, key: type) -> Callable[[Any, Any], Any]:
        """Return the function for a type; raises TypeException if there is none."""
        try:
            return self._functions[key]
        except KeyError:
            raise TypeException(f"Type {key} is not loaded or supported") from None

    def print_me(self) -> None:
        """Print all functions."""
        print(self._functions)


class ConvertRegistration:
    """The functions that convert data to and from messages, by its type."""

    _to_message: ClassVar[dict[type, Callable[[Any], Any]]] = {}
    _from_message: ClassVar[dict[type, Callable[[Any], Any]]] = {}
    _direct: ClassVar[dict[tuple[type, type], Callable[[Any], Any]]] = {}

    def add_from_msg(self, key: type, callback: Callable[[Any], Any]) -> None:
        """Register a function that makes a type from a message."""
        self._from_message[key] = callback

    def add_to_msg(self, key: type, callback: Callable[[Any], Any]) -> None:
        """Register a function that makes a message from a type."""
        self._to_message[key] = callback

    def add_convert(self, key: tuple[type, type], callback: Callable[[Any], Any]) -> None:
        """Register a function that converts one type to another."""
        self._direct[key] = callback

    def get_from_msg(self, key: type) -> Callable[[Any], Any]:
        """Return the function that makes a type from a message; raises TypeException."""
        return _found(self._from_message, key)

    def get_to_msg(self, key: type) -> Callable[[Any], Any]:
        """Return the function that makes a message from a type; raises TypeException."""
        return _found(self._to_message, key)

    def get_convert(self, key: tuple[type, type]) -> Callable[[Any], Any]:
        """Return the function that converts one type to another; raises TypeException."""
        return _found(self._direct, key)


def _found(functions: dict[Any, Callable[[Any], Any]], key: Any) -> Callable[[Any], Any]:
    try:
        return functions[key]
    except KeyError:
        raise TypeException(f"Type {key} is not loaded or supported") from None


def convert(a: Any, b_type: type) -> Any:
    """Convert data to another type, directly or over a message."""
    registration = ConvertRegistration()
    if type(a) is b_type:
        return deepcopy(a)
    try:
        return registration.get_convert((type(a), b_type))(a)
    except TypeException:
        message = registration.get_to_msg(type(a))(a)
        return registration.get_from_msg(b_type)(message)


class BufferInterface:
    """Transforms stamped data with what `lookup_transform` of a subclass finds."""

    def __init__(self) -> None:
        self.registration = TransformRegistration()

    def transform(
        self, object_stamped: Any, target_frame: str, timeout: Duration = Duration(), new_type: type | None = None
    ) -> Any:
        """Return stamped data in another frame, at the time of its stamp.

        Args:
            object_stamped: Data with a header, whose type is registered: `import tf2_geometry_msgs` does that.
            target_frame: Frame of the result.
            timeout: How long to wait for the transform.
            new_type: Type to convert the result to.
        """
        function = self.registration.get(type(object_stamped))
        header = object_stamped.header
        found = self.lookup_transform(target_frame, header.frame_id, Time.from_msg(header.stamp), timeout)
        return _converted(function(object_stamped, found), new_type)

    def transform_full(
        self,
        object_stamped: Any,
        target_frame: str,
        target_time: Time,
        fixed_frame: str,
        timeout: Duration = Duration(),
        new_type: type | None = None,
    ) -> Any:
        """Return stamped data in another frame at another time, over a frame that does not move in between."""
        function = self.registration.get(type(object_stamped))
        header = object_stamped.header
        found = self.lookup_transform_full(
            target_frame, target_time, header.frame_id, Time.from_msg(header.stamp), fixed_frame, timeout
        )
        return _converted(function(object_stamped, found), new_type)

    def lookup_transform(self, target_frame: str, source_frame: str, time: Time, timeout: Duration = Duration()) -> Any:
        """Return the transform from the source frame to the target frame."""
        raise NotImplementedException

    def lookup_transform_full(
        self,
        target_frame: str,
        target_time: Time,
        source_frame: str,
        source_time: Time,
        fixed_frame: str,
        timeout: Duration = Duration(),
    ) -> Any:
        """Return the transform between two frames at two times."""
        raise NotImplementedException


def _converted(found: Any, new_type: type | None) -> Any:
    return found if new_type is None else convert(found, new_type)
