"""Named arrays in one .npz file: equal arrays give equal bytes."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from mapping.io.atomic import write_bytes_atomically
from mapping.io.safe_load import read_limited, reading

MAX_BYTES = 2**30
"""Maximum size of a file, and of its unpacked arrays: ten hours of scans."""

_ZIP_MAGIC = b"PK\x03\x04"


def save_npz(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write the arrays to one file, atomically. Raises ``OSError`` if it cannot be written.

    They are not compressed: noisy ranges compress by an eighth only, which takes longer than to simulate them.
    """
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)  # type: ignore[arg-type]
    write_bytes_atomically(path, buffer.getvalue())


def load_npz(path: Path, names: Iterable[str]) -> dict[str, NDArray[Any]]:
    """Read the arrays of these names, without executing anything in the file.

    Raises ``ValueError`` naming the file if it is not an .npz file, is damaged or too large, or lacks an array;
    ``OSError`` if it cannot be read.
    """
    data = read_limited(path, MAX_BYTES)
    if not data.startswith(_ZIP_MAGIC):
        raise ValueError(f"{path}: not an .npz file")
    with reading(path), zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {info.filename: info for info in archive.infolist()}
        left, arrays = MAX_BYTES, {}
        for name in names:
            info = members.get(f"{name}.npy")
            if info is None:
                raise ValueError(f"has no array {name!r}")
            left -= info.file_size
            if left < 0:
                raise ValueError(f"unpacks to more than {MAX_BYTES} bytes")
            if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise ValueError(f"array {name!r} is packed by method {info.compress_type}, must be stored or deflated")
            arrays[name] = _array(name, archive.read(info))
        return arrays


def _array(name: str, data: bytes) -> NDArray[Any]:
    """Parse a .npy member; the header's shape must be that of the bytes, so that nothing more is allocated."""
    file = io.BytesIO(data)
    readers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    version = npy.read_magic(file)
    if version not in readers:
        raise ValueError(f"array {name!r} is of version {version}, must be 1.0 or 2.0")
    shape, by_columns, dtype = readers[version](file)
    if dtype.hasobject or dtype.itemsize == 0:
        raise ValueError(f"array {name!r} is of type {dtype}, must be numbers or text, no pickle")
    start = file.tell()
    if len(data) - start != math.prod(shape) * dtype.itemsize or min(shape, default=0) < 0:
        raise ValueError(f"array {name!r} of shape {shape} and type {dtype} has {len(data) - start} bytes")
    flat = np.frombuffer(bytearray(data[start:]), dtype)
    return flat.reshape(shape, order="F" if by_columns else "C")
