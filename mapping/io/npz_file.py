"""Named arrays in one .npz file: equal arrays give equal bytes."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.io.atomic import write_bytes_atomically

_ZIP_MAGIC = b"PK\x03\x04"
_READING_ERRORS = (
    *(KeyError, ValueError, EOFError, OSError, MemoryError, SyntaxError),
    *(zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error, struct.error),
    *(NotImplementedError, RuntimeError),  # zipfile's, for other compressions and for encryption
)


def save_npz(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write the arrays to one file, atomically. Raises ``OSError`` if it cannot be written.

    They are not compressed: noisy ranges compress by an eighth only, which takes longer than to simulate them.
    """
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)  # type: ignore[arg-type]
    write_bytes_atomically(path, buffer.getvalue())


def load_npz(path: Path, names: Iterable[str]) -> dict[str, NDArray[Any]]:
    """Read the arrays of these names, without executing anything in the file.

    Raises ``ValueError`` naming the file if it is not an .npz file, is damaged, or lacks an array; ``OSError`` if it
    cannot be read.
    """
    data = path.read_bytes()
    if not data.startswith(_ZIP_MAGIC):
        raise ValueError(f"{path}: not an .npz file")
    arrays = {}
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            for name in names:
                if name not in archive:
                    raise ValueError(f"has no array {name!r}")
                arrays[name] = archive[name]
    except _READING_ERRORS as error:
        raise ValueError(f"{path}: damaged or of another kind: {' '.join(str(error).split())[:200]}") from None
    return arrays
