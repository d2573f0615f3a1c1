"""Reads the maps of a rubric as ROS's map_server does: a YAML file and the image that it names, beside the rubric."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from grader.grading.rubrics.map_images import MapImage, NoImage, read_image
from grader.grading.rubrics.mistakes import nearest_hint, refused_file
from grader.grading.rubrics.own_checks import OwnFile, beside_file, own_files
from grader.grading.rubrics.yaml_tree import YamlSyntaxError, YamlTree, read_yaml
from grader.runtime.model.errors import RubricError
from grader.runtime.model.wording import printable
from grader.runtime.simulation import WallMap

#: The keys of a map file; the others have defaults or are not needed.
KEYS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode")
MODES = ("trinary", "scale", "raw")
#: The largest image file, in bytes: a PGM of the most pixels with 16 bits each.
MOST_BYTES = 16 * 1024 * 1024
#: In raw mode, a pixel of this value, of 255, is a wall.
RAW_WALL = 100
_IMAGE = re.compile(r"(?:[A-Za-z0-9_][A-Za-z0-9_.-]*/)*[A-Za-z0-9_][A-Za-z0-9_.-]*\.(?:pgm|png)", re.IGNORECASE)


def map_files(rubric: Path, names: Sequence[str], never_in: Sequence[Path] = ()) -> tuple[OwnFile, ...]:
    """Return the map files that a rubric names, each followed by its image.

    Raises:
        RubricError: A file is missing or cannot be used; see `own_files`. Or it does not name its image.
    """
    found: list[OwnFile] = []
    for file in own_files(rubric, names, never_in, key="maps"):
        tree = _tree(file)
        image = tree.data.get("image") if isinstance(tree.data, Mapping) else None
        if not (isinstance(image, str) and _IMAGE.fullmatch(image)):
            said = "none" if image is None else f"`{printable(str(image))}`"
            mistake = tree.at(("image",)).mistake(f"expected `image`, a .pgm or .png file beside it, found {said}")
            raise refused_file(file.path, [mistake])
        name = (Path(file.name).parent / image).as_posix()
        where = f"{printable(str(file.path), 500)}:{tree.at(('image',)).line}: image: {printable(image)}"
        found += [file, beside_file(rubric, name, never_in, where, most=MOST_BYTES)]
    return tuple(found)


def maps_of(files: Sequence[OwnFile]) -> dict[str, WallMap]:
    """Return the maps in files of `map_files`, by the name that the rubric gives; raises RubricError for a mistake."""
    return {file.name: _map_of(file, image) for file, image in zip(files[::2], files[1::2], strict=True)}


def _tree(file: OwnFile) -> YamlTree:
    try:
        return read_yaml(file.content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        where = printable(str(file.path), 500)
        raise RubricError(f"{where}: expected UTF-8 text, found the byte 0x{file.content[error.start]:02x}") from None
    except YamlSyntaxError as error:
        raise refused_file(file.path, [error.mistake]) from None


def _map_of(file: OwnFile, image: OwnFile) -> WallMap:
    tree = _tree(file)
    data: Any = tree.data
    mistakes = list(tree.mistakes)
    for key in data:
        if key not in KEYS:
            text = f"expected a key of a map ({', '.join(KEYS)}), found `{printable(str(key))}`"
            mistakes.append(tree.at_key((key,)).mistake(text, nearest_hint(str(key), KEYS)))
    values: dict[str, Any] = {}
    for key, expected, fits in _EXPECTED:
        if key in data and not fits(data[key]):
            found = printable(str(data[key]))
            mistakes.append(tree.at((key,)).mistake(f"expected {expected} in `{key}`, found {found}"))
        elif key not in data and key in ("resolution", "origin"):
            mistakes.append(tree.at(()).mistake(f"expected `{key}`, found none"))
        values[key] = data.get(key)
    if not mistakes and (values["free_thresh"] or 0.25) > (values["occupied_thresh"] or 0.65):
        text = "expected a `free_thresh` that is not above `occupied_thresh`, found one that is"
        mistakes.append(tree.at(("free_thresh",)).mistake(text))
    if mistakes:
        raise refused_file(file.path, mistakes)
    try:
        pixels = read_image(image.content)
    except NoImage as error:
        raise RubricError(f"{printable(str(image.path), 500)}: {error}") from None
    return _walls_of(pixels, values)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _is_origin(value: object) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(_is_number, value)) and value[2] == 0


#: Key, what is expected in it, and whether a value fits.
_EXPECTED: Sequence[tuple[str, str, Any]] = (
    ("resolution", "the side of a cell in m, above 0", lambda value: _is_number(value) and value > 0),
    ("origin", "x, y and yaw of the lower left corner, with a yaw of 0", _is_origin),
    ("negate", "0 or 1", lambda value: value in (0, 1)),
    ("occupied_thresh", "a share from 0 to 1", lambda value: _is_number(value) and 0 <= value <= 1),
    ("free_thresh", "a share from 0 to 1", lambda value: _is_number(value) and 0 <= value <= 1),
    ("mode", f"one of {', '.join(MODES)}", lambda value: value in MODES),
)


def _walls_of(image: MapImage, values: Mapping[str, Any]) -> WallMap:
    """Return which cells are walls, by the rules of nav2's map_server; free and unknown cells are not."""
    import numpy as np  # noqa: PLC0415 - most rubrics have no map

    mode = values["mode"] or "trinary"
    threshold = 0.65 if values["occupied_thresh"] is None else values["occupied_thresh"]
    # grey counts as three equal colours, beside which the alpha channel of a trinary map counts once
    colours = np.broadcast_to(image.colours, (*image.colours.shape[:2], 3))
    shade = colours.mean(axis=2)
    if mode == "trinary" and image.alpha is not None:
        shade = (colours.sum(axis=2) + image.alpha) / 4
    if mode == "raw":
        occupied = np.round(shade * 255) == RAW_WALL
    else:
        occupied = (shade if values["negate"] else 1.0 - shade) > threshold
        if mode == "scale" and image.alpha is not None:
            occupied &= image.alpha == 1
    height, width = occupied.shape
    x, y, _ = values["origin"]
    cells = np.packbits(occupied[::-1]).tobytes()
    return WallMap(width, height, float(values["resolution"]), float(x), float(y), cells)
