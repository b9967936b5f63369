"""Grey pictures of maps, PGM and PNG, with limits that protect against hostile files."""

from __future__ import annotations

import io
import struct
import warnings
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mapping.grid.frame import MAX_PICTURE_CELLS
from mapping.io.pgm import pgm_bytes, read_header, read_pgm

MAX_BYTES = 2**30
"""Maximum size of a picture file."""

_PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_PNG_ERRORS = (OSError, SyntaxError, ValueError, EOFError, struct.error, zlib.error, Image.DecompressionBombError)


@dataclass(frozen=True, eq=False)
class Picture:
    """Brightness ``grey`` (H, W) uint8, top row first; ``opaque`` (H, W) bool, None without an alpha channel."""

    grey: NDArray[np.uint8]
    opaque: NDArray[np.bool_] | None = None


def read_picture(path: Path) -> Picture:
    """Read a PGM or PNG, detected by content, as 8-bit grey; colours by Rec. 601 luma, 16 bits scaled down.

    Raises ``ValueError`` naming the file if it is empty, of another kind, broken, truncated or too large, and
    ``OSError`` if it cannot be opened.
    """
    data = read_limited(path, MAX_BYTES)
    try:
        if data[:2] in (b"P2", b"P5"):
            header = read_header(data)
            _check_size(header.width, header.height)
            return Picture(read_pgm(data))
        if data.startswith(_PNG_MAGIC):
            return _read_png(data)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    raise ValueError(f"{path}: not a PGM or PNG picture; it starts with {data[:8]!r}")


def read_limited(path: Path, max_bytes: int) -> bytes:
    """Read a file of at most ``max_bytes``.

    Raises ``ValueError`` naming the file if it is empty, larger, or not a regular file; ``OSError`` if it cannot be
    read.
    """
    size = path.stat().st_size
    if not path.is_file():
        raise ValueError(f"{path}: not a file")
    if size == 0:
        raise ValueError(f"{path}: the file is empty")
    if size > max_bytes:
        raise ValueError(f"{path}: the file has {size} bytes, more than the {max_bytes} that are read")
    return path.read_bytes()


def picture_bytes(picture: Picture, kind: str) -> bytes:
    """Encode a picture as ``kind`` "pgm" or "png": equal pictures give equal bytes.

    Raises ``ValueError`` for another kind, or for transparency in a PGM.
    """
    if kind == "png":
        return _png_bytes(picture)
    if kind != "pgm":
        raise ValueError(f"picture kind is {kind!r}, must be 'pgm' or 'png'")
    if picture.opaque is not None:
        raise ValueError("a PGM has no transparency: write a PNG")
    return pgm_bytes(picture.grey)


def _check_size(width: int, height: int) -> None:
    if width * height > MAX_PICTURE_CELLS:
        raise ValueError(f"the picture has {width} x {height} pixels, more than the {MAX_PICTURE_CELLS} that are read")


def _read_png(data: bytes) -> Picture:
    # The header chunk comes first and has a fixed place, so that the size is known before the decoder sees the file.
    if len(data) < 24 or data[12:16] != b"IHDR":
        raise ValueError("the PNG header is broken")
    _check_size(*struct.unpack(">II", data[16:24]))
    if b"IEND" not in data:
        raise ValueError("the PNG is truncated: it has no end chunk")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=("PNG",)) as image:
                image.load()
                return _grey_and_alpha(image)
    except _PNG_ERRORS as error:
        raise ValueError(f"the PNG is broken or truncated ({' '.join(str(error).split())})") from error


def _grey_and_alpha(image: Image.Image) -> Picture:
    if image.mode.startswith("I"):
        values = np.asarray(image).astype(np.uint32)
        return Picture(((values * 255 + 32767) // 65535).astype(np.uint8))
    if image.has_transparency_data:
        red_green_blue_alpha = image.convert("RGBA")
        grey = np.array(red_green_blue_alpha.convert("RGB").convert("L"))
        return Picture(grey, np.asarray(red_green_blue_alpha.getchannel("A")) == 255)
    return Picture(np.array(image.convert("RGB").convert("L") if image.mode == "P" else image.convert("L")))


def _png_bytes(picture: Picture) -> bytes:
    image = Image.fromarray(picture.grey)
    if picture.opaque is not None:
        image.putalpha(Image.fromarray(np.where(picture.opaque, 255, 0).astype(np.uint8)))
    file = io.BytesIO()
    image.save(file, format="PNG", compress_level=6)
    return file.getvalue()
