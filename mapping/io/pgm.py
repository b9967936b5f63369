"""Portable graymaps, plain (P2) and raw (P5), by the netpbm specification."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

_GAP = rb"(?:[ \t\r\n\v\f]|#[^\r\n]*[\r\n])"
_MAX_HEADER = 2**16  # bytes; longer comments than that are no header
_HEADER = re.compile(rb"P([25])" + (_GAP + rb"+(\d{1,10})") * 3 + _GAP, re.DOTALL)
_COMMENT = re.compile(rb"#[^\r\n]*")


@dataclass(frozen=True)
class PgmHeader:
    """Header of a PGM; the pixels start at ``offset`` [bytes]."""

    plain: bool
    width: int
    height: int
    maxval: int
    offset: int

    @property
    def raster_bytes(self) -> int:
        """Minimum size of the pixels [bytes]."""
        pixels = self.width * self.height
        if self.plain:
            return 2 * pixels - 1
        return pixels * (1 if self.maxval < 256 else 2)


def read_header(data: bytes) -> PgmHeader:
    """Parse the header of a PGM. Raises ``ValueError`` (without a file name) if it is broken or the maxval is wrong."""
    match = _HEADER.match(data[:_MAX_HEADER])
    if match is None:
        raise ValueError("the PGM header is broken")
    kind, width, height, maxval = (int(number) for number in match.groups())
    if min(width, height) < 1:
        raise ValueError(f"the PGM is {width} x {height} pixels")
    if not 1 <= maxval <= 65535:
        raise ValueError(f"the PGM's maxval is {maxval}, must be 1 to 65535")
    header = PgmHeader(kind == 2, width, height, maxval, match.end())
    # A program that ends lines by CR LF writes one byte more than the single space that netpbm allows there.
    one_more = len(data) - header.offset == header.raster_bytes + 1 and not header.plain
    if one_more and data[header.offset - 1 : header.offset + 1] == b"\r\n":
        return replace(header, offset=header.offset + 1)
    return header


def read_pgm(data: bytes) -> NDArray[np.uint8]:
    """Decode the pixels (H, W) of a PGM, top row first, scaled to 0..255 by its maxval.

    Raises ``ValueError`` (without a file name) if the header is broken, pixels are missing or exceed the maxval.
    """
    header = read_header(data)
    found = len(data) - header.offset
    if found < header.raster_bytes:
        raise ValueError(
            f"the PGM is truncated: {header.width} x {header.height} pixels need "
            f"{header.raster_bytes} bytes, but {found} are there"
        )
    values = _plain_values(data, header) if header.plain else _raw_values(data, header)
    largest = int(values.max())
    if largest > header.maxval:
        raise ValueError(f"a pixel of the PGM is {largest}, but its maxval is {header.maxval}")
    return _scaled_to_255(values, header.maxval).reshape(header.height, header.width)


def _raw_values(data: bytes, header: PgmHeader) -> NDArray[np.integer]:
    dtype = np.dtype(np.uint8 if header.maxval < 256 else ">u2")
    return np.frombuffer(data, dtype, count=header.width * header.height, offset=header.offset)


def _plain_values(data: bytes, header: PgmHeader) -> NDArray[np.integer]:
    text = _COMMENT.sub(b"", data[header.offset :])
    strange = text.translate(None, b"0123456789 \t\r\n\v\f")
    if strange:
        raise ValueError(f"the plain PGM holds {strange[:10]!r} among its numbers")
    values = np.fromstring(text, dtype=np.int64, sep=" ")
    pixels = header.width * header.height
    if values.size < pixels:
        raise ValueError(f"the PGM is truncated: {pixels} pixels are announced, {values.size} are there")
    return values[:pixels]


def _scaled_to_255(values: NDArray[np.integer], maxval: int) -> NDArray[np.uint8]:
    if maxval == 255:
        return values.astype(np.uint8)
    # One look-up instead of wide arithmetic on every pixel.
    table = ((np.arange(maxval + 1) * 255 + maxval // 2) // maxval).astype(np.uint8)
    scaled: NDArray[np.uint8] = table[values]
    return scaled


def pgm_bytes(grey: NDArray[np.uint8]) -> bytes:
    """Encode pixels (H, W), top row first, as a raw PGM."""
    height, width = grey.shape
    return b"P5\n%d %d\n255\n" % (width, height) + np.ascontiguousarray(grey, dtype=np.uint8).tobytes()
