"""The YAML file of a map in the format of ROS map_server."""

from __future__ import annotations

import math
import re
import reprlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, cast, get_args

import yaml

from mapping.geometry.se2 import SE2
from mapping.io.safe_load import read_limited, reading
from mapping.io.safe_path import safe_path

Mode = Literal["trinary", "scale", "raw"]

OCCUPIED_THRESHOLD, FREE_THRESHOLD = 0.65, 0.196
"""Defaults of map_server: grey 205, which savers write for unknown, has p = 0.19608 and so is just not free."""

MAX_BYTES = 2**16
"""Maximum size of a YAML file; real ones have 150 bytes."""

_LARGEST_FLOAT32 = 3.4e38
"""Largest number in single precision, in which nav2 compares."""

SMALLEST_RESOLUTION, LARGEST_RESOLUTION = 1e-5, 1e5
"""Limits of the cell size [m]: others are a wrong unit."""

FARTHEST_ORIGIN = 1e9
"""Largest coordinate of an origin [m]: beyond it cells of a tenth of a micrometre coincide in double precision."""

_TABS = re.compile(r"(?<=[:,\[-])[ \t]*\t[ \t]*")
"""Tabs between a field and its value: YAML allows none, but their meaning is clear."""

PARAMETERS = "ros__parameters"
"""Key of the parameters in a file of ROS 2."""

_TRUE = ("y", "yes", "true", "on")
_FALSE = ("n", "no", "false", "off")


@dataclass(frozen=True)
class MapYaml:
    """Content of the YAML: ``image`` relative to its folder, ``resolution`` [m/cell], ``origin``, and thresholds.

    ``origin`` is the pose of the outer corner of the lower left pixel. ``negate``, the thresholds and ``mode`` convert
    grey to occupancy.

    Raises ``ValueError`` naming the field if the resolution or the origin is out of range, a threshold is not finite or
    the mode is unknown.
    """

    image: str
    resolution: float = 1.0
    origin: SE2 = field(default_factory=SE2)
    negate: bool = False
    occupied_thresh: float = OCCUPIED_THRESHOLD
    free_thresh: float = FREE_THRESHOLD
    mode: Mode = "trinary"

    def __post_init__(self) -> None:
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise ValueError(f"resolution is {self.resolution}, must be positive and finite")
        if not SMALLEST_RESOLUTION <= self.resolution <= LARGEST_RESOLUTION:
            bounds = f"{SMALLEST_RESOLUTION:g} and {LARGEST_RESOLUTION:g}"
            raise ValueError(f"resolution is {self.resolution} m, must lie between {bounds}")
        if not max(abs(self.origin.x), abs(self.origin.y)) <= FARTHEST_ORIGIN:
            raise ValueError(f"origin is {self.origin.x}, {self.origin.y} m, must lie within {FARTHEST_ORIGIN:g} m")
        for name in ("occupied_thresh", "free_thresh"):
            if not abs(getattr(self, name)) < _LARGEST_FLOAT32:
                raise ValueError(f"{name} is {getattr(self, name)}, must be finite")
        if self.mode not in get_args(Mode):
            raise ValueError(f"mode is {self.mode!r}, must be trinary, scale or raw")


def read_map_yaml(path: Path) -> tuple[MapYaml, tuple[str, ...]]:
    """Read a map's YAML by the rules of nav2's loader; return it with warnings, without the file's name.

    A yaw of NaN, which some mappers write, is read as 0 with a warning, and missing thresholds as map_server's
    defaults. Raises ``ValueError`` naming file, field and value for anything else; ``OSError`` if it cannot be read.
    """
    warnings: list[str] = []
    try:
        fields = _parse(read_limited(path, MAX_BYTES))
        meta = MapYaml(
            image=_text(fields, "image"),
            resolution=_number(fields, "resolution"),
            origin=_origin(fields, warnings),
            negate=_flag(fields, "negate"),
            occupied_thresh=_threshold(fields, "occupied_thresh", OCCUPIED_THRESHOLD, warnings),
            free_thresh=_threshold(fields, "free_thresh", FREE_THRESHOLD, warnings),
            mode=cast(Mode, _text(fields, "mode").lower() if "mode" in fields else "trinary"),
        )
        _require_order(meta)
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(f"{path}: ") else f"{path}: {text}") from error
    return meta, tuple(warnings)


def image_path(path: Path, meta: MapYaml) -> Path:
    """Return the path of the picture that the YAML at ``path`` names.

    A picture that is not there is taken from beside the YAML, by its base name: many files name the path that it had on
    another machine, or from the working directory. Nothing outside the YAML's folder is opened, because a map from a
    stranger must not make the program open other files; an absolute path into the folder is allowed.

    Raises ``ValueError`` naming both if the path is outside and no such picture lies beside the YAML.
    """
    image, beside = safe_path(path.parent, meta.image), path.parent / _base_name(meta.image)
    if image is not None and (image.is_file() or not beside.is_file()):
        return image
    if beside.is_file() and safe_path(path.parent, beside.name) is not None:
        return beside
    raise ValueError(
        f"{path}: image is {_shown(meta.image)}, outside the YAML's folder or a link that leads out; "
        "put the picture itself beside the YAML"
    )


def image_warnings(path: Path, meta: MapYaml) -> tuple[str, ...]:
    """Warn if the picture is not where the YAML says."""
    image = image_path(path, meta)
    if image == safe_path(path.parent, meta.image):
        return ()
    return (f"image is {_shown(meta.image)}; {image.name} beside the YAML is read instead",)


def _base_name(image: str) -> str:
    return re.split(r"[/\\]", image)[-1]


def _require_order(meta: MapYaml) -> None:
    """Refuse thresholds that are no probabilities, or whose names are swapped."""
    if meta.mode == "raw":
        return
    for name in ("occupied_thresh", "free_thresh"):
        value = getattr(meta, name)
        if not 0.0 <= value <= 1.0:
            hint = f"; {value:g} looks like per cent, which is {value / 100.0:g}" if 1.0 < value <= 100.0 else ""
            raise ValueError(f"{name} is {value:g}, must lie in 0 to 1{hint}")
    if meta.free_thresh > meta.occupied_thresh:
        raise ValueError(
            f"free_thresh is {meta.free_thresh:g}, must be at most occupied_thresh, {meta.occupied_thresh:g}; "
            "are the two swapped?"
        )


def map_yaml_text(meta: MapYaml) -> str:
    """Return the text of the YAML with numbers at full precision (nav2's own saver rounds to three decimals)."""
    origin = [meta.origin.x, meta.origin.y, meta.origin.yaw]
    fields = {
        "image": meta.image,
        "mode": meta.mode,
        "resolution": meta.resolution,
        "origin": origin,
        "negate": int(meta.negate),
        "occupied_thresh": meta.occupied_thresh,
        "free_thresh": meta.free_thresh,
    }
    return yaml.safe_dump(fields, sort_keys=False, default_flow_style=None, allow_unicode=True, width=10_000)


def _parse(data: bytes) -> dict[str, Any]:
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise ValueError("the YAML is UTF-16, must be UTF-8")
    with reading("not a YAML file"):
        # Every scalar stays text: whether `image: 1.pgm` or `negate: no` is a number is decided here, not by YAML.
        loader = yaml.BaseLoader(_TABS.sub(" ", data.decode("utf-8")))
        node = loader.get_single_node()
        fields = loader.construct_document(node) if node is not None else None
    if node is None or not isinstance(fields, dict):
        raise ValueError(f"the YAML is {_shown(fields)}, not a map's fields")
    _refuse_repeated(str(key.value) for key, _ in node.value)
    return fields


def _refuse_repeated(names: Iterable[str]) -> None:
    # YAML forbids it; readers differ in which of the two they take.
    seen = set()
    for name in names:
        if name in seen:
            raise ValueError(f"the YAML has the field {_shown(name)} twice")
        seen.add(name)


def _field(fields: dict[str, Any], name: str) -> Any:
    if name not in fields:
        if PARAMETERS in str(fields):
            raise ValueError("is a file of ROS parameters; give the map's own YAML, such as that of yaml_filename")
        raise ValueError(f"the YAML has no field {name}")
    return fields[name]


def _text(fields: dict[str, Any], name: str) -> str:
    value = _field(fields, name)
    if not isinstance(value, str) or not value:
        raise ValueError(f"{name} is {_shown(value)}, must be a name")
    return value


def _number(fields: dict[str, Any], name: str) -> float:
    return _as_number(name, _field(fields, name))


def _as_number(name: str, value: Any) -> float:
    try:
        # YAML writes .nan and .inf, -.inf; Python reads them without the dot.
        plain = value.lower().replace(".nan", "nan").replace(".inf", "inf")
        return float(plain)
    except (ValueError, AttributeError):
        raise ValueError(f"{name} is {_shown(value)}, must be a number") from None


def _threshold(fields: dict[str, Any], name: str, default: float, warnings: list[str]) -> float:
    if name in fields:
        return _number(fields, name)
    warnings.append(f"no field {name}; {default} is used")
    return default


def _origin(fields: dict[str, Any], warnings: list[str]) -> SE2:
    values = _field(fields, "origin")
    if not isinstance(values, list) or len(values) != 3:
        raise ValueError(f"origin is {_shown(values)}, must be a list of x, y, yaw")
    numbers = [_as_number("origin", value) for value in values]
    if math.isnan(numbers[2]):
        warnings.append("the origin's yaw is NaN; 0 is used")
        numbers[2] = 0.0
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"origin is {_shown(values)}, must be finite")
    return SE2(*numbers)


def _flag(fields: dict[str, Any], name: str) -> bool:
    value = fields.get(name, "0")
    if isinstance(value, str):
        if value.lower() in _TRUE + _FALSE:
            return value.lower() in _TRUE
        if value.lstrip("+-").isdecimal() and len(value) < 20:
            return int(value) != 0
    raise ValueError(f"{name} is {_shown(value)}, must be 0 or 1")


def _shown(value: object) -> str:
    # A value from a file may nest or repeat itself without end.
    return reprlib.repr(value)[:100]
