"""Reads the images of maps, PGM and PNG, as ROS's map_saver and drawing programs write them: an author's files.

No library that the grader depends on reads PNG. numpy and zlib do it in a page, and a rubric then needs nothing else.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from grader.runtime.model.dataclass import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: Most pixels of a map: 2000 by 2000, at 5 cm a hall of 100 m.
MOST_PIXELS = 4_000_000
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
#: The channels of each kind of colour in a PNG: grey, RGB, palette, grey and alpha, RGB and alpha.
_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
#: The numbers of bits that each of them may have.
_DEPTHS = {0: (1, 2, 4, 8, 16), 2: (8, 16), 3: (1, 2, 4, 8), 4: (8, 16), 6: (8, 16)}
_SPACE = rb"(?:\s|#[^\n]*\n)+"
_PGM = re.compile(rb"(P[25])" + _SPACE + rb"(\d{1,9})" + _SPACE + rb"(\d{1,9})" + _SPACE + rb"(\d{1,5})\s")


class NoImage(ValueError):  # noqa: N818 - reads as what it says
    """A file is not an image of a map; the text says what was expected and what was found."""


@dataclass(frozen=True, slots=True)
class MapImage:
    """The pixels of an image, each channel from 0 to 1: shape (rows, columns, channels), the first row on top.

    Attributes:
        colours: One channel of grey or three of colour.
        alpha: How opaque each pixel is, shape (rows, columns); None if the image does not say.
    """

    colours: NDArray[np.float64]
    alpha: NDArray[np.float64] | None = None


def read_image(content: bytes) -> MapImage:
    """Read a PGM or PNG image; raises NoImage for anything else, and for what no map needs."""
    if content.startswith(_SIGNATURE):
        return _read_png(content)
    if content[:2] in (b"P2", b"P5"):
        return _read_pgm(content)
    raise NoImage("expected a PGM or PNG image, found something else")


def _of_size(width: int, height: int) -> None:
    if not (width and height and width * height <= MOST_PIXELS):
        raise NoImage(f"expected 1 to {MOST_PIXELS:,} pixels, found {width} by {height}")


def _read_pgm(content: bytes) -> MapImage:
    import numpy as np  # noqa: PLC0415 - most rubrics have no map

    head = _PGM.match(content)
    if head is None:
        raise NoImage("expected width, height and largest value after P2 or P5, found something else")
    width, height, most = (int(head[number]) for number in (2, 3, 4))
    _of_size(width, height)
    if not 0 < most < 1 << 16:
        raise NoImage(f"expected a largest value from 1 to 65535, found {most}")
    rest, count = content[head.end() :], width * height
    if head[1] == b"P5":
        kind = ">u2" if most > 255 else "u1"
        pixels = np.frombuffer(rest[: count * np.dtype(kind).itemsize], dtype=kind) if rest else np.zeros(0)
    else:
        words = rest.split()[:count]
        pixels = np.array([int(word) if word.isdigit() and len(word) < 6 else -1 for word in words])
    if pixels.size != count or (pixels.size and not 0 <= int(pixels.min()) <= int(pixels.max()) <= most):
        raise NoImage(f"expected {count:,} values from 0 to {most}, found others or fewer")
    return MapImage(pixels.reshape(height, width, 1) / most)


def _read_png(content: bytes) -> MapImage:
    import numpy as np  # noqa: PLC0415 - as above

    chunks = [*_chunks(content)]
    parts = {kind: data for kind, data in chunks if kind != b"IDAT"}
    head = parts.get(b"IHDR", b"")
    if len(head) != 13:
        raise NoImage("expected the size of the image at the beginning of the PNG, found none")
    width, height, bits, colour, _, _, interlaced = struct.unpack(">IIBBBBB", head)
    _of_size(width, height)
    if bits not in _DEPTHS.get(colour, ()):
        raise NoImage(f"expected a kind of colour that PNG has, found {colour} with {bits} bits")
    if interlaced:
        raise NoImage("expected a PNG that is not interlaced, found one that is: save it without")
    channels = _CHANNELS[colour]
    line = -(-width * channels * bits // 8)
    packed = [data for kind, data in chunks if kind == b"IDAT"]
    lines = _unfiltered(_inflated(packed, height * (line + 1)), height, line, max(1, channels * bits // 8))
    values = np.asarray(_values(lines, width * channels, bits), dtype=np.int64).reshape(height, width, channels)
    if colour == 3:
        return _from_palette(values[:, :, 0], parts.get(b"PLTE", b""), parts.get(b"tRNS", b""))
    shares = values / ((1 << bits) - 1)
    return MapImage(shares[:, :, :-1], shares[:, :, -1]) if colour in (4, 6) else MapImage(shares)


def _values(lines: Any, count: int, bits: int) -> Any:
    """Return the numbers in lines of bytes, so many in a line, each of so many bits."""
    import numpy as np  # noqa: PLC0415 - as above

    if bits == 16:
        return lines.view(">u2")
    if bits == 8:
        return lines
    return np.unpackbits(lines, axis=1)[:, : count * bits].reshape(-1, count, bits) @ (1 << np.arange(bits)[::-1])


def _chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    place = len(_SIGNATURE)
    while place < len(content):
        size = int.from_bytes(content[place : place + 4], "big")
        kind, data = content[place + 4 : place + 8], content[place + 8 : place + 8 + size]
        checked = content[place + 8 + size : place + 12 + size]
        if len(checked) != 4 or zlib.crc32(kind + data) != int.from_bytes(checked, "big"):
            raise NoImage("expected a whole PNG, found one that is cut off or damaged")
        yield kind, data
        if kind == b"IEND":
            return
        place += 12 + size


def _inflated(packed: list[bytes], expected: int) -> bytes:
    decoder = zlib.decompressobj()
    try:
        content = decoder.decompress(b"".join(packed), expected)  # never more than the size in the head
    except zlib.error as error:
        raise NoImage(f"expected the pixels of a PNG, found damaged ones ({error})") from None
    if len(content) != expected:
        raise NoImage(f"expected {expected:,} bytes of pixels, found {len(content):,}")
    return content


def _unfiltered(content: bytes, height: int, line: int, back: int) -> NDArray[np.uint8]:
    """Undo what PNG does to each line before it is packed: differences to the left, above, or both."""
    import numpy as np  # noqa: PLC0415 - as above

    rows = np.frombuffer(content, dtype=np.uint8).reshape(height, line + 1)
    done = np.zeros((height, line), dtype=np.uint8)
    above = np.zeros(line, dtype=np.uint8)
    for number, row in enumerate(rows):
        kind, values = int(row[0]), row[1:]
        if kind == 0:
            above = values
        elif kind == 2:
            above = values + above
        elif kind == 1:
            sums = np.zeros(-(-line // back) * back, dtype=np.uint8)
            sums[:line] = values
            above = np.cumsum(sums.reshape(-1, back), axis=0, dtype=np.uint8).reshape(-1)[:line]
        elif kind in (3, 4):
            above = _predicted(kind, values.tolist(), above.tolist(), back)
        else:
            raise NoImage(f"expected a filter from 0 to 4 in line {number + 1} of the PNG, found {kind}")
        done[number] = above
    return done


def _predicted(kind: int, values: list[int], above: list[int], back: int) -> NDArray[np.uint8]:
    """Undo the filters that look at several neighbours: their mean, or Paeth's choice of the nearest."""
    import numpy as np  # noqa: PLC0415 - as above

    found = [0] * len(values)
    for place, value in enumerate(values):
        left = found[place - back] if place >= back else 0
        up = above[place]
        if kind == 3:
            guess = (left + up) // 2
        else:
            corner = above[place - back] if place >= back else 0
            to_left, to_up, to_corner = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
            nearest = min(to_left, to_up, to_corner)
            guess = left if nearest == to_left else up if nearest == to_up else corner
        found[place] = (value + guess) & 255
    return np.array(found, dtype=np.uint8)


def _from_palette(numbers: Any, palette: bytes, clear: bytes) -> MapImage:
    import numpy as np  # noqa: PLC0415 - as above

    colours = np.frombuffer(palette[: len(palette) // 3 * 3], dtype=np.uint8).reshape(-1, 3)
    if int(numbers.max()) >= len(colours):
        raise NoImage(f"expected a colour for each pixel in the palette of {len(colours)}, found a number beyond it")
    alpha = np.full(len(colours), 255.0)
    alpha[: len(clear)] = np.frombuffer(clear, dtype=np.uint8)[: len(colours)]
    return MapImage(colours[numbers] / 255, alpha[numbers] / 255 if clear else None)
