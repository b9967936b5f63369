"""Grey pictures of maps, with limits that protect against hostile files."""

from __future__ import annotations

import io
import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mapping.grid.frame import MAX_PICTURE_CELLS
from mapping.io.pgm import pgm_bytes, read_header, read_pgm
from mapping.io.safe_load import read_limited, reading

MAX_BYTES = 2**30
"""Maximum size of a picture file."""

_PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_OTHERS = {
    b"BM": "BMP",
    b"P1": "PPM",
    b"P3": "PPM",
    b"P4": "PPM",
    b"P6": "PPM",
    b"II*\0": "TIFF",
    b"MM\0*": "TIFF",
    b"\xff\xd8\xff": "JPEG",
}
"""First bytes of other pictures that are read, and Pillow's name of their kind (PPM: plain and raw PBM and PPM)."""
_LFS = b"version https://git-lfs"
_JPEG_NOISE = 8
"""A JPEG's grey so near to one of a map saver's is meant to be that."""
_SAVED_GREYS = (0, 205, 254)
_BAND_PIXELS = 2**22
"""Pixels that are converted at a time."""


@dataclass(frozen=True, eq=False)
class Picture:
    """Brightness ``grey`` (H, W) uint8, top row first; ``opaque`` (H, W) bool, None without an alpha channel;
    ``lossy`` if the greys are inexact."""

    grey: NDArray[np.uint8]
    opaque: NDArray[np.bool_] | None = None
    lossy: bool = False


MAX_HEADER = 1000
"""Number of bytes in which the YAML of a map names its picture."""


def read_picture(path: Path) -> Picture:
    """Read a PGM, PNG, BMP, PPM, TIFF or JPEG, detected by content, as 8-bit grey.

    Colours count by Rec. 601 luma, 16 bits are scaled down. A JPEG's greys near those of a map saver become these.

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
        for magic, kind in _OTHERS.items():
            if data.startswith(magic):
                return _read_other(data, kind)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    if data.startswith(_LFS):
        raise ValueError(f"{path}: is a pointer of Git LFS, not the picture; run `git lfs pull`")
    if b"image:" in data[:MAX_HEADER]:
        raise ValueError(f"{path}: is no picture, but looks like the YAML of a map; give it a name that ends in .yaml")
    raise ValueError(f"{path}: not a PGM, PNG, BMP, PPM, TIFF or JPEG picture; it starts with {data[:8]!r}")


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
    with _decoding("PNG"), Image.open(io.BytesIO(data), formats=("PNG",)) as image:
        image.load()
        return _grey_and_alpha(image)


def _read_other(data: bytes, kind: str) -> Picture:
    with _decoding(kind):
        image = Image.open(io.BytesIO(data), formats=(kind,))
    with image:
        _check_size(*image.size)
        with _decoding(kind):
            image.load()
            found = _grey_and_alpha(image)
    if kind != "JPEG":
        return found
    levels = np.arange(256)
    table = levels.copy()
    for saved in _SAVED_GREYS:
        table[abs(levels - saved) <= _JPEG_NOISE] = saved
    return Picture(table.astype(np.uint8)[found.grey], lossy=True)


@contextmanager
def _decoding(kind: str) -> Iterator[None]:
    """Name what Pillow cannot decode; sizes are checked by ``_check_size``, not by its warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        try:
            with reading(f"the {kind} is broken or truncated"):
                yield
        except Image.DecompressionBombError:
            raise ValueError(f"the picture has more than the {MAX_PICTURE_CELLS} pixels that are read") from None


def _grey_and_alpha(image: Image.Image) -> Picture:
    """Convert band by band, because a colour picture of some kilobytes can unpack to gigabytes."""
    width, height = image.size
    grey = np.empty((height, width), np.uint8)
    transparent = image.has_transparency_data and not image.mode.startswith("I")
    opaque = np.empty((height, width), np.bool_) if transparent else None
    rows = max(1, _BAND_PIXELS // width)
    for first in range(0, height, rows):
        band, place = image.crop((0, first, width, min(first + rows, height))), slice(first, first + rows)
        if opaque is not None:
            red_green_blue_alpha = band.convert("RGBA")
            opaque[place] = np.asarray(red_green_blue_alpha.getchannel("A")) == 255
            band = red_green_blue_alpha.convert("RGB")
        grey[place] = _grey(band)
    return Picture(grey, opaque)


def _grey(image: Image.Image) -> NDArray[np.uint8]:
    if image.mode.startswith("I"):
        return ((np.asarray(image).astype(np.uint32) * 255 + 32767) // 65535).astype(np.uint8)
    return np.asarray(image.convert("RGB").convert("L") if image.mode == "P" else image.convert("L"))


def _png_bytes(picture: Picture) -> bytes:
    image = Image.fromarray(picture.grey)
    if picture.opaque is not None:
        image.putalpha(Image.fromarray(np.where(picture.opaque, 255, 0).astype(np.uint8)))
    file = io.BytesIO()
    image.save(file, format="PNG", compress_level=6)
    return file.getvalue()
