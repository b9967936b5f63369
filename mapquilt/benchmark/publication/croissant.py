"""croissant.json: a description of exported Parquet files in the format Croissant of MLCommons, version 1.0."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mapquilt.benchmark.publication.rows import COLUMNS, Column, Kind

CROISSANT_FILE = "croissant.json"

_TERMS = (
    *("citeAs", "column", "extract", "field", "fileProperty", "fileObject", "fileSet", "format", "includes"),
    *("isLiveDataset", "jsonPath", "key", "md5", "parentField", "path", "recordSet", "references", "regex", "repeated"),
    *("replace", "samplingRate", "separator", "source", "subField", "transform"),
)
CONTEXT: dict[str, Any] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "sc": "https://schema.org/",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "dct": "http://purl.org/dc/terms/",
    "conformsTo": "dct:conformsTo",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "equivalentProperty": "cr:equivalentProperty",
    **{term: f"cr:{term}" for term in _TERMS},
}
"""Context of the specification."""

DATA_TYPES: dict[Kind, str] = {
    "text": "sc:Text",
    "number": "sc:Float",
    "flag": "sc:Boolean",
    "picture": "sc:ImageObject",
}


def croissant_record(
    name: str, about: str, licences: Sequence[str], version: str, files: Mapping[str, tuple[str, str]]
) -> dict[str, Any]:
    """Describe one Parquet file for each split: ``files`` are its path and SHA-256 by the name of the split."""
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": name,
        "description": about,
        "license": [f"https://spdx.org/licenses/{licence}.html" for licence in licences],
        "version": version,
        "distribution": [
            {
                "@type": "cr:FileObject",
                "@id": f"{split}.parquet",
                "name": f"{split}.parquet",
                "contentUrl": path,
                "encodingFormat": "application/x-parquet",
                "sha256": digest,
            }
            for split, (path, digest) in files.items()
        ],
        "recordSet": [
            {
                "@type": "cr:RecordSet",
                "@id": split,
                "name": split,
                "field": [_field(split, column) for column in COLUMNS],
            }
            for split in files
        ],
    }


def _field(split: str, column: Column) -> dict[str, Any]:
    source: dict[str, Any] = {"fileObject": {"@id": f"{split}.parquet"}, "extract": {"column": column.name}}
    if column.kind == "picture":
        source["transform"] = {"jsonPath": "bytes"}
    return {
        "@type": "cr:Field",
        "@id": f"{split}/{column.name}",
        "name": column.name,
        "description": column.about,
        "dataType": DATA_TYPES[column.kind],
        "source": source,
    }
