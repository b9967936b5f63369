"""Card of an exported data set, as Hugging Face reads it: README.md and eval.yaml."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from mapquilt.benchmark.publication.rows import COLUMNS, Column, Kind

CARD_FILE, EVALUATION_FILE = "README.md", "eval.yaml"
SIZES = ((1_000, "n<1K"), (10_000, "1K<n<10K"), (100_000, "10K<n<100K"), (1_000_000, "100K<n<1M"))
"""Categories of Hugging Face by the number of rows that they stay below."""

DTYPES: dict[Kind, str] = {"text": "string", "number": "float64", "flag": "bool", "picture": "image"}
"""Types of ``datasets`` by the kind of a column."""

TEMPLATE = """\
# {{ card.name }}

{{ card.about }}

| split | pairs | truth | digest |
|---|---:|---|---|
{% for split in splits %}
| {{ split.name }} | {{ split.pairs }} | {{ "given" if split.truth else "withheld" }} | `{{ split.digest }}` |
{% endfor %}

The digest is that of the pairs and their truth, which `mapquilt benchmark` writes to summary.json: two results are
comparable if it is the same. No world is in two splits.

{% if card.layout == "webdataset" %}
Each pair is three files of a tar in `data/`: `NAME.target.png`, `NAME.source.png`, and `NAME.json` with all else.

    from datasets import load_dataset
    pairs = load_dataset(".", split="{{ splits[-1].name }}", streaming=True)
{% else %}
    from datasets import load_dataset
    pairs = load_dataset(".", split="{{ splits[-1].name }}")
    pairs[0]["target"].show()
{% endif %}

| column | meaning |
|---|---|
{% for column in columns %}
| `{{ column.name }}` | {{ column.about }} |
{% endfor %}

The true transform takes a pixel of the source, x right, y down, centres at integers, to the target:
`target = scale R(rotation_deg) source + (tx, ty)`. Where truth is withheld, its columns are empty.

Answer every pair with one row of a CSV file: `pair, scale, rotation_deg, tx, ty, confidence, accepted, seconds`. With
the data set that this was exported from, `mapquilt benchmark --dataset DATA --split {{ splits[-1].name }} --answers
answers.csv --out bench` scores it.

Made by {{ card.generator }}: `mapquilt dataset export`. Licence: {{ card.licences | join(", ") }}.
"""


@dataclass(frozen=True)
class SplitCard:
    """Tell of one split: its number of ``pairs``, the ``digest`` of the pairs, and if their ``truth`` is given."""

    name: str
    pairs: int
    digest: str
    truth: bool


@dataclass(frozen=True)
class Card:
    """Tell of a data set: ``licences`` as SPDX names, ``generator`` the program that made it, ``ending`` of files."""

    name: str
    about: str
    licences: tuple[str, ...]
    generator: str
    layout: str
    ending: str


def card_text(card: Card, splits: Sequence[SplitCard]) -> str:
    """Write README.md: a block of metadata, then the text."""
    import jinja2

    pairs = sum(split.pairs for split in splits)
    metadata: dict[str, Any] = {
        "pretty_name": card.name,
        "license": [licence.lower() for licence in card.licences],
        "tags": ["robotics", "occupancy-grid", "map-merging", "image-registration", "simulation"],
        "size_categories": [next((name for bound, name in SIZES if pairs < bound), "n>1M")],
        "dataset_info": {"features": _features(card.layout)},
        "configs": [
            {
                "config_name": "default",
                "data_files": [{"split": split.name, "path": f"data/{split.name}-*{card.ending}"} for split in splits],
            }
        ],
    }
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, trim_blocks=True, keep_trailing_newline=True)
    text = environment.from_string(TEMPLATE).render(card=card, splits=splits, columns=COLUMNS)
    return f"---\n{yaml.safe_dump(metadata, sort_keys=False)}---\n\n{text}"


def _features(layout: str) -> list[dict[str, Any]]:
    """Return the columns that ``datasets`` shows: it would guess those of tar files from the first rows."""
    if layout != "webdataset":
        return [_feature(column) for column in COLUMNS]
    pictures = [column for column in COLUMNS if column.kind == "picture"]
    return [
        {"name": "__key__", "dtype": "string"},
        {"name": "__url__", "dtype": "string"},
        *({"name": f"{column.name}.png", "dtype": "image"} for column in pictures),
        {"name": "json", "struct": [_feature(column) for column in COLUMNS if column not in pictures]},
    ]


def _feature(column: Column) -> dict[str, Any]:
    return {"name": column.name, "dtype": DTYPES[column.kind]}


def evaluation_text(card: Card, splits: Sequence[SplitCard]) -> str:
    """Write eval.yaml, which registers a data set as a benchmark: its task is the last split."""
    tasks = [{"id": card.name, "config": "default", "split": splits[-1].name}]
    record = {"name": card.name, "description": card.about, "evaluation_framework": "mapquilt", "tasks": tasks}
    return yaml.safe_dump(record, sort_keys=False)
