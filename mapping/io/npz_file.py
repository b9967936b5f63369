"""Named arrays in one .npz: the same arrays give the same bytes, and a broken file is refused by name."""

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

from mapping.io.atomic import write_bytes_aside

_ZIP_MAGIC = b"PK\x03\x04"
_READING_ERRORS = (
    *(KeyError, ValueError, EOFError, OSError, MemoryError, SyntaxError),
    *(zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error, struct.error),
    *(NotImplementedError, RuntimeError),  # zipfile's, for other compressions and for encryption
)


def save_npz(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write the arrays aside and rename the file into place. Raises ``OSError`` where it cannot be written.

    They are stored as they are: ranges are full of noise, and compressing them takes longer than sensing them, to save
    an eighth of the file.
    """
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)  # type: ignore[arg-type]
    write_bytes_aside(path, buffer.getvalue())


def load_npz(path: Path, names: Iterable[str]) -> dict[str, NDArray[Any]]:
    """The arrays of these names. Nothing in the file is executed.

    Raises ``ValueError`` naming the file where it is no such file, is damaged, or lacks an array; ``OSError`` where it
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
