"""Maps of a rubric: images as another library reads them, the rules of map_server, and mistakes with their place."""

from __future__ import annotations

import io
import random
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from grader.grading.rubrics.loader import read_rubric, side_files
from grader.grading.rubrics.map_images import NoImage, read_image
from grader.grading.rubrics.maps import map_files, maps_of
from grader.runtime.model.errors import RubricError
from grader.runtime.simulation import WallMap
from grader.runtime.stimuli.simulation import Simulated

MAP = """\
image: room.pgm
resolution: 0.05
origin: [-1.0, -0.5, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.25
"""
#: Two rows of three pixels: a wall on top left, an unknown one in the middle, a wall at the bottom right.
PGM = b"P5\n# map_saver\n3 2\n255\n" + bytes([0, 205, 254, 254, 254, 0])
RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: follow, number: "1", title: Follow}
files: [follow.py]
maps: [room.yaml]
scenarios:
  - id: alone
    processes: [follow.py]
    observe: {duration: 5 s}
    stimuli:
      - simulation: {robot_in_map: {map: MAP, x: 5.0, obstacles: [{x: {between: [0.1, 0.9]}, y: 3, to_x: 1, to_y: 4}]}}
criteria:
  - {id: lives, title: Lives, points: 1, scenario: alone, hint: none, check: {no_fault: {}}}
"""


def read(folder: Path, text: str = MAP, image: bytes = PGM, name: str = "room.pgm") -> WallMap:
    (folder / "room.yaml").write_text(text, encoding="utf-8")
    (folder / name).write_bytes(image)
    return maps_of(map_files(folder / "rubric.yaml", ["room.yaml"]))["room.yaml"]


def cells(map_: WallMap) -> list[list[int]]:
    """Return the cells of a map, the row with the least y first."""
    bits = np.unpackbits(np.frombuffer(map_.cells, dtype=np.uint8), count=map_.width * map_.height)
    return bits.reshape(map_.height, map_.width).tolist()  # type: ignore[no-any-return]


def png(image: Image.Image, **options: object) -> bytes:
    out = io.BytesIO()
    image.save(out, "PNG", **options)
    return out.getvalue()


def pixels(mode: str, seed: int, width: int = 13, height: int = 9) -> Image.Image:
    """Return an image of drawn pixels in smooth and rough parts, so that an encoder uses every filter."""
    draw = np.random.default_rng(seed)
    bands = {"L": 1, "RGB": 3, "LA": 2, "RGBA": 4}[mode]
    smooth = np.add.outer(np.arange(height) * 9, np.arange(width) * 5)[:, :, None] + np.arange(bands) * 40
    rough = draw.integers(0, 256, (height, width, bands))
    mixed = np.where(np.arange(height)[:, None, None] % 3 == 0, rough, smooth % 256).astype(np.uint8)
    return Image.fromarray(mixed[:, :, 0] if bands == 1 else mixed, mode)


def test_a_map_is_read_as_map_server_does(tmp_path: Path) -> None:
    """The last row of the image is the first of the map; unknown cells are no walls."""
    map_ = read(tmp_path)
    assert (map_.width, map_.height, map_.resolution, map_.x, map_.y) == (3, 2, 0.05, -1.0, -0.5)
    assert cells(map_) == [[0, 0, 1], [1, 0, 0]]
    assert cells(read(tmp_path, MAP.replace("negate: 0", "negate: 1"))) == [[1, 1, 0], [0, 1, 1]]
    assert cells(read(tmp_path, MAP.replace("0.65", "0.1").replace("0.25", "0.05"))) == [[0, 0, 1], [1, 1, 0]]
    raw = PGM[:-6] + bytes([100, 0, 50, 255, 99, 100])
    assert cells(read(tmp_path, MAP + "mode: raw\n", raw)) == [[0, 0, 1], [1, 0, 0]]


def test_of_a_map_only_image_resolution_and_origin_are_needed(tmp_path: Path) -> None:
    """The thresholds of map_server are the defaults, and a text image is read too."""
    text = "image: room.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n"
    assert cells(read(tmp_path, text, b"P2 3 2 255\n0 205 254\n254 254 0\n")) == [[0, 0, 1], [1, 0, 0]]


def test_transparent_pixels_count_as_in_map_server(tmp_path: Path) -> None:
    """In a trinary map the alpha channel is one of the four whose mean is taken; in scale it has to be opaque."""
    image = Image.new("RGBA", (2, 1))
    image.putdata([(0, 0, 0, 255), (0, 0, 0, 0)])
    text = MAP.replace("room.pgm", "room.png")
    assert cells(read(tmp_path, text, png(image), "room.png")) == [[1, 1]]
    assert cells(read(tmp_path, text + "mode: scale\n", png(image), "room.png")) == [[1, 0]]


@pytest.mark.parametrize("mode", ["L", "RGB", "LA", "RGBA"])
@pytest.mark.parametrize("seed", range(4))
def test_png_images_are_those_of_another_library(mode: str, seed: int) -> None:
    """Of each kind of colour, with the filters that an encoder chooses."""
    image = pixels(mode, seed, width=13 + seed)
    found = read_image(png(image))
    want = np.asarray(image, dtype=float).reshape(image.height, image.width, -1) / 255
    assert np.allclose(found.colours, want[:, :, : found.colours.shape[2]])
    assert (found.alpha is None) == (mode in ("L", "RGB"))
    if found.alpha is not None:
        assert np.allclose(found.alpha, want[:, :, -1])


def test_palettes_and_few_or_many_bits(tmp_path: Path) -> None:
    """As drawing programs save small images."""
    image = pixels("L", 1)
    for colours in (2, 4, 16, 200):
        palette = image.quantize(colours)
        assert np.allclose(read_image(png(palette)).colours, np.asarray(palette.convert("RGB")) / 255)
    black = image.point(lambda value: 255 * (value > 99)).convert("1")
    assert np.allclose(read_image(png(black)).colours[:, :, 0], np.asarray(black, dtype=float))
    deep = Image.fromarray((np.asarray(image, dtype=np.uint16) * 257).astype(np.uint16))
    assert np.allclose(read_image(png(deep)).colours[:, :, 0], np.asarray(image) / 255)


@pytest.mark.parametrize("filter_", range(5))
def test_each_filter_of_png_is_undone(filter_: int) -> None:
    """Lines that were filtered by its definition."""
    draw = random.Random(filter_)
    rows = [[draw.randrange(256) for _ in range(6)] for _ in range(4)]
    packed = b""
    for number, row in enumerate(rows):
        above = rows[number - 1] if number else [0] * 6
        line = []
        for place, value in enumerate(row):
            left, corner = (row[place - 1], above[place - 1]) if place else (0, 0)
            up = above[place]
            paeth = min(
                [(abs(up - corner), 0, left), (abs(left - corner), 1, up), (abs(left + up - 2 * corner), 2, corner)]
            )[2]
            line.append((value - [0, left, up, (left + up) // 2, paeth][filter_]) % 256)
        packed += bytes([filter_, *line])
    head = struct.pack(">IIBBBBB", 6, 4, 8, 0, 0, 0, 0)
    chunks = [(b"IHDR", head), (b"IDAT", zlib.compress(packed)), (b"IEND", b"")]
    parts = [struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in chunks]
    found = read_image(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
    assert (found.colours[:, :, 0] * 255).round().astype(int).tolist() == rows


GOOD = png(pixels("L", 3))


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"GIF89a", "expected a PGM or PNG image, found something else"),
        (b"P5 3", "expected width, height and largest value after P2 or P5, found something else"),
        (b"P5 3 2 255\n12345", "expected 6 values from 0 to 255, found others or fewer"),
        (b"P2 2 1 9\n1 x", "expected 2 values from 0 to 9, found others or fewer"),
        (b"P5 99999 99999 255\n", "expected 1 to 4,000,000 pixels, found 99999 by 99999"),
        (b"P5 3 2 0\n123456", "expected a largest value from 1 to 65535, found 0"),
        (GOOD[:60], "expected a whole PNG, found one that is cut off or damaged"),
        (GOOD[:-20] + b"x" + GOOD[-19:], "expected a whole PNG, found one that is cut off or damaged"),
        (b"\x89PNG\r\n\x1a\n", "expected the size of the image at the beginning of the PNG, found none"),
    ],
)
def test_other_images_are_refused(content: bytes, told: str) -> None:
    """With what was expected."""
    with pytest.raises(NoImage) as caught:
        read_image(content)
    assert str(caught.value) == told


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("resolution: 1\n", "room.yaml:1:1: expected `image`, a .pgm or .png file beside it, found none"),
        (MAP.replace("room.pgm", "/etc/map.pgm"), "1:8: expected `image`, a .pgm or .png file beside it, found"),
        (MAP.replace("0.05", "0"), "2:13: expected the side of a cell in m, above 0 in `resolution`, found 0"),
        (MAP.replace("-0.5, 0.0", "-0.5, 0.3"), "3:9: expected x, y and yaw of the lower left corner, with a yaw of 0"),
        (MAP.replace("negate: 0", "negate: 2"), "4:9: expected 0 or 1 in `negate`, found 2"),
        (MAP.replace("0.65", "1.65"), "5:18: expected a share from 0 to 1 in `occupied_thresh`, found 1.65"),
        (MAP.replace("0.25", "0.95"), "6:14: expected a `free_thresh` that is not above `occupied_thresh`"),
        (MAP + "mode: colour\n", "7:7: expected one of trinary, scale, raw in `mode`, found colour"),
        (MAP + "modes: raw\n", "7:1: expected a key of a map (image, resolution, origin, negate,"),
        (MAP.replace("resolution: 0.05\n", ""), "expected `resolution`, found none"),
        (MAP + "x: [", "not valid YAML"),
    ],
)
def test_a_mistake_in_a_map_is_told_with_its_place(tmp_path: Path, text: str, told: str) -> None:
    """Its file, line and column."""
    with pytest.raises(RubricError) as caught:
        read(tmp_path, text)
    assert told in caught.value.message


def test_what_is_wrong_with_the_image_names_it(tmp_path: Path) -> None:
    """Its file; and a file that is not there, the line that names it."""
    with pytest.raises(RubricError, match=r"room\.pgm: expected a PGM or PNG image"):
        read(tmp_path, image=b"nothing")
    (tmp_path / "room.pgm").unlink()
    with pytest.raises(RubricError, match=r"room\.yaml:1: image: room\.pgm: expected a file beside the rubric"):
        map_files(tmp_path / "rubric.yaml", ["room.yaml"])


def written(folder: Path, name: str) -> Path:
    read(folder)
    (folder / "rubric.yaml").write_text(RUBRIC.replace("MAP", name), encoding="utf-8")
    return folder / "rubric.yaml"


def test_a_rubric_lists_its_maps(tmp_path: Path) -> None:
    """A simulation gets them, the digest covers both files, and they travel with the rubric."""
    path = written(tmp_path, "room.yaml")
    exercise = read_rubric(path)
    (stimulus,) = exercise.scenarios[0].stimuli
    assert isinstance(stimulus, Simulated)
    assert [name for name, _ in stimulus.maps] == ["room.yaml"]
    assert {file.name for file in side_files(path)} == {"room.yaml", "room.pgm"}
    (tmp_path / "room.pgm").write_bytes(PGM[:-1] + b"\xfe")
    assert read_rubric(path).digest != exercise.digest


def test_a_map_that_is_not_listed_is_told_at_its_name(tmp_path: Path) -> None:
    """Also if a seed may draw it."""
    path = written(tmp_path, "{choose: [room.yaml, hall.yaml]}")
    with pytest.raises(RubricError, match=r"rubric\.yaml:10:42: expected a map .* \(room\.yaml\), found `hall\.yaml`"):
        read_rubric(path)


def test_the_parts_of_a_parameter_are_read_strictly(tmp_path: Path) -> None:
    """With the place of what is wrong in them."""
    path = written(tmp_path, "room.yaml")
    path.write_text(path.read_text(encoding="utf-8").replace("to_y: 4", "to_z: 4"), encoding="utf-8")
    with pytest.raises(RubricError, match=r"to_z"):
        read_rubric(path)
