"""The bridge between images of ROS and of OpenCV.

The behaviour is that of https://docs.ros.org/en/jazzy/p/cv_bridge/ as documented. Only what no other way can do needs
OpenCV: compressed images, and the conversions of Bayer and YUV patterns.
"""

from __future__ import annotations

import re
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CompressedImage, Image

__all__ = ["CvBridge", "CvBridgeError"]

#: Colours of each encoding, by channel; the number behind it is the bits of a channel.
_COLOURS = {"rgb8": "rgb", "bgr8": "bgr", "rgba8": "rgba", "bgra8": "bgra", "mono8": "y"}
_COLOURS |= {"rgb16": "rgb", "bgr16": "bgr", "rgba16": "rgba", "bgra16": "bgra", "mono16": "y"}
_TYPES = {"U": "uint", "S": "int", "F": "float"}
#: Share of red, green and blue in the brightness, as in ITU-R BT.601, which OpenCV uses.
_WEIGHTS = {"r": 0.299, "g": 0.587, "b": 0.114}


class CvBridgeError(TypeError):
    """An image cannot be converted."""


class CvBridge:
    """Converts images; it has no state."""

    def encoding_to_dtype_with_channels(self, encoding: str) -> tuple[str, int]:
        """Return numpy's type and the number of channels of an encoding: `bgr8` -> `("uint8", 3)`."""
        if encoding in _COLOURS:
            return f"uint{re.sub(r'[a-z]', '', encoding)}", len(_COLOURS[encoding])
        if re.fullmatch(r"bayer_\w+8", encoding):
            return "uint8", 1
        if re.fullmatch(r"bayer_\w+16", encoding):
            return "uint16", 1
        if encoding in ("yuv422", "yuv422_yuy2", "uyvy", "yuyv"):
            return "uint8", 2
        match = re.fullmatch(r"(8|16|32|64)([USF])C(\d+)?", encoding)
        if match is None:
            raise CvBridgeError(f"Unrecognized image encoding [{encoding}]")
        return f"{_TYPES[match[2]]}{match[1]}", int(match[3] or 1)

    def encoding_to_cvtype2(self, encoding: str) -> int:
        """Return OpenCV's number of an encoding, such as 16 for `bgr8` (CV_8UC3)."""
        kind, channels = self.encoding_to_dtype_with_channels(encoding)
        depths = {"uint8": 0, "int8": 1, "uint16": 2, "int16": 3, "int32": 4, "float32": 5, "float64": 6}
        if kind not in depths:
            raise CvBridgeError(f"Unrecognized image encoding [{encoding}]")
        return depths[kind] + ((channels - 1) << 3)

    def dtype_with_channels_to_cvtype2(self, dtype: Any, n_channels: int) -> str:
        """Return the encoding of an array's type: `("uint8", 3)` -> `8UC3`."""
        kind = np.dtype(dtype)
        return f"{kind.itemsize * 8}{ {'u': 'U', 'i': 'S', 'f': 'F'}[kind.kind] }C{n_channels}"

    def cvtype2_to_dtype_with_channels(self, cvtype: int) -> tuple[str, int]:
        """Return numpy's type and the number of channels of OpenCV's number."""
        kinds = ("uint8", "int8", "uint16", "int16", "int32", "float32", "float64")
        return kinds[cvtype & 7], (cvtype >> 3) + 1

    def imgmsg_to_cv2(self, img_msg: Image, desired_encoding: str = "passthrough") -> NDArray[Any]:
        """Return an image as an array, (height, width) or (height, width, channels).

        Args:
            img_msg: The message.
            desired_encoding: Encoding of the result; `passthrough` keeps that of the message.

        Raises:
            CvBridgeError: The image is damaged, or there is no such conversion.
        """
        kind, channels = self.encoding_to_dtype_with_channels(img_msg.encoding)
        pixel = np.dtype(kind).newbyteorder(">" if img_msg.is_bigendian else "<")
        line = img_msg.width * channels * pixel.itemsize
        content = np.frombuffer(bytes(img_msg.data), np.uint8)
        step = img_msg.step or line
        if step < line or content.size < step * img_msg.height:
            raise CvBridgeError(
                f"Image is wrongly formed: height * step != size or {img_msg.height} * {step} != {content.size}"
            )
        rows = content[: step * img_msg.height].reshape(img_msg.height, step)[:, :line]
        image = np.ascontiguousarray(rows).view(pixel).reshape(img_msg.height, img_msg.width, channels)
        image = image.astype(pixel.newbyteorder("="))
        if channels == 1:
            image = image[:, :, 0]
        return (
            image if desired_encoding == "passthrough" else self._converted(image, img_msg.encoding, desired_encoding)
        )

    def _converted(self, image: NDArray[Any], have: str, want: str) -> NDArray[Any]:
        kind, channels = self.encoding_to_dtype_with_channels(want)
        if have == want:
            return image
        if have in _COLOURS and want in _COLOURS:
            return _depth(_recoloured(image, _COLOURS[have], _COLOURS[want]), kind)
        if have not in _COLOURS and want not in _COLOURS and not have.startswith(("bayer", "yuv", "uyvy", "yuyv")):
            if (1 if image.ndim == 2 else image.shape[2]) == channels and image.dtype == np.dtype(kind):
                return image
        elif (1 if image.ndim == 2 else image.shape[2]) == channels and image.dtype == np.dtype(kind):
            return image  # a generic type has no colours that could differ
        if have.startswith("bayer"):
            return _by_opencv(image, have, want)
        raise CvBridgeError(f"[{have}] is not a color format. but [{want}] is. The conversion does not make sense")

    def cv2_to_imgmsg(self, cvim: NDArray[Any], encoding: str = "passthrough", header: Any = None) -> Image:
        """Return an array, (height, width) or (height, width, channels), as a message.

        Args:
            cvim: The image.
            encoding: Its encoding; `passthrough` names its type, such as `8UC3`.
            header: Header of the message.
        """
        if not isinstance(cvim, (np.ndarray, np.generic)):
            raise TypeError("Your input type is not a numpy array")
        channels = 1 if cvim.ndim < 3 else cvim.shape[2]
        own = self.dtype_with_channels_to_cvtype2(cvim.dtype, channels)
        if encoding != "passthrough":
            if self.encoding_to_cvtype2(encoding) != self.encoding_to_cvtype2(own):
                raise CvBridgeError(f"encoding specified as {encoding}, but image has incompatible type {own}")
            own = encoding
        message = Image(height=cvim.shape[0], width=cvim.shape[1], encoding=own)
        if header is not None:
            message.header = header
        message.is_bigendian = int(
            cvim.dtype.byteorder == ">" or (cvim.dtype.byteorder == "=" and sys.byteorder == "big")
        )
        message.data = np.ascontiguousarray(cvim).tobytes()
        message.step = len(message.data) // max(1, cvim.shape[0])
        return message

    def compressed_imgmsg_to_cv2(
        self, cmprs_img_msg: CompressedImage, desired_encoding: str = "passthrough"
    ) -> NDArray[Any]:
        """Return a compressed image as an array; needs OpenCV."""
        import cv2

        image = cv2.imdecode(np.frombuffer(bytes(cmprs_img_msg.data), np.uint8), cv2.IMREAD_UNCHANGED)
        if image is None:
            raise CvBridgeError("the compressed image cannot be decoded")
        if desired_encoding == "passthrough":
            return image
        have = {2: "mono8"}.get(image.ndim) or {3: "bgr8", 4: "bgra8"}[image.shape[2]]
        return self._converted(image, have, desired_encoding)

    def cv2_to_compressed_imgmsg(self, cvim: NDArray[Any], dst_format: str = "jpg") -> CompressedImage:
        """Return an array as a compressed message, such as `jpg` or `png`; needs OpenCV."""
        import cv2

        if not isinstance(cvim, (np.ndarray, np.generic)):
            raise TypeError("Your input type is not a numpy array")
        done, content = cv2.imencode(f".{dst_format}", cvim)
        if not done:
            raise CvBridgeError(f"the image cannot be encoded as {dst_format}")
        message = CompressedImage(format=dst_format)
        message.data = content.tobytes()
        return message


def _recoloured(image: NDArray[Any], have: str, want: str) -> NDArray[Any]:
    """Return an image with other channels: swapped, grey, or with full opacity added."""
    if have == want:
        return image
    if have == "y":
        opaque = _most(image.dtype)
        return np.stack([np.full_like(image, opaque) if c == "a" else image for c in want], axis=-1)
    if want == "y":
        grey = sum(_WEIGHTS[c] * image[:, :, have.index(c)].astype(float) for c in "rgb")
        return np.asarray(np.rint(grey)).astype(image.dtype)
    full = np.full(image.shape[:2], _most(image.dtype), dtype=image.dtype)
    return np.stack([image[:, :, have.index(c)] if c in have else full for c in want], axis=-1)


def _most(kind: np.dtype[Any]) -> int:
    return int(np.iinfo(kind).max)


def _depth(image: NDArray[Any], kind: str) -> NDArray[Any]:
    """Return an image with 8 or 16 bits for each channel, over the whole range."""
    if image.dtype == np.dtype(kind):
        return image
    if kind == "uint16":
        return image.astype(np.uint16) * 257
    return np.rint(image / 257).astype(np.uint8)


def _by_opencv(image: NDArray[Any], have: str, want: str) -> NDArray[Any]:
    """Return a Bayer image in colours or grey; needs OpenCV."""
    import cv2

    # OpenCV names a pattern by the second row's second and third pixels, ROS by the first two of the first row.
    pattern = {"rggb": "BG", "bggr": "RG", "gbrg": "GR", "grbg": "GB"}.get(have.split("_")[1].rstrip("0123456789"))
    target = {"bgr8": "BGR", "rgb8": "RGB", "mono8": "GRAY"}.get(want)
    if pattern is None or target is None:
        raise CvBridgeError(f"there is no conversion from [{have}] to [{want}]")
    return np.asarray(cv2.cvtColor(image, getattr(cv2, f"COLOR_BAYER_{pattern}2{target}")))
