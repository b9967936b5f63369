"""Publish the digests of finished data sets in the repository.

``python -m benchmarks.published DATA ...`` verifies each data set and writes its digests to
mapquilt/dataset/published.json, with which ``mapquilt dataset verify --published`` compares.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from mapping.io.atomic import write_bytes_atomically
from mapquilt.dataset import published
from mapquilt.dataset.manifest import read_manifest
from mapquilt.dataset.verify import verify_dataset


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the digests of the data sets, beside those of all others; a data set of the same name is replaced."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("data", type=Path, nargs="+")
    records = published.published_records()
    for folder in parser.parse_args(arguments).data:
        problems = verify_dataset(folder)
        if problems:
            raise SystemExit(f"{folder}: {problems[0]}; {len(problems)} problems in all")
        records[str(read_manifest(folder).header["name"])] = published.published_record(folder)
    text = json.dumps(dict(sorted(records.items())), indent=1) + "\n"
    write_bytes_atomically(Path(published.__file__).with_name(published.PUBLISHED_FILE), text.encode())
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
