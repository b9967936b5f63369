"""Pairs as a Parquet file, whose pictures the library ``datasets`` shows."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mapquilt.benchmark.publication.rows import COLUMNS, Kind, Row

if TYPE_CHECKING:
    import pyarrow as pa

ROWS_AT_ONCE = 100
"""Rows of a row group, which are in memory together: about 3 MB."""

FEATURES: dict[Kind, dict[str, str]] = {
    "text": {"dtype": "string", "_type": "Value"},
    "number": {"dtype": "float64", "_type": "Value"},
    "flag": {"dtype": "bool", "_type": "Value"},
    "picture": {"_type": "Image"},
}
"""Features of ``datasets`` by the kind of a column."""


def write_parquet(path: Path, rows: Iterator[Row]) -> None:
    """Write rows to a Parquet file, a few in memory at a time. Raises ``ImportError`` if pyarrow is missing."""
    try:
        from pyarrow import RecordBatch, parquet
    except ImportError:
        raise ImportError("dataset export to Parquet needs pyarrow: pip install 'mapquilt[export]'") from None
    schema = _schema()
    with parquet.ParquetWriter(path, schema, compression="zstd") as writer:
        while some := list(islice(rows, ROWS_AT_ONCE)):
            writer.write_batch(RecordBatch.from_pylist([_values(row) for row in some], schema))


def _schema() -> pa.Schema:
    """Return the types of all columns, with the features of ``datasets`` as metadata."""
    import pyarrow as pa

    types = {
        "text": pa.string(),
        "number": pa.float64(),
        "flag": pa.bool_(),
        "picture": pa.struct([("bytes", pa.binary()), ("path", pa.string())]),
    }
    features = {column.name: FEATURES[column.kind] for column in COLUMNS}
    return pa.schema(
        [(column.name, types[column.kind]) for column in COLUMNS],
        metadata={"huggingface": json.dumps({"info": {"features": features}})},
    )


def _values(row: Row) -> dict[str, Any]:
    pictures = {
        column.name: {"bytes": row[column.name], "path": None} for column in COLUMNS if column.kind == "picture"
    }
    return row | pictures
