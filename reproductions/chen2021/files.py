"""Files of a finished reproduction."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from mapping.io.transaction import write_files_atomically
from mapquilt.viz.png import figure_png
from reproductions.chen2021.cases import CASES, PLACES, Case
from reproductions.chen2021.make import Study, maps_file
from reproductions.chen2021.map_store import read_maps
from reproductions.chen2021.table import answers_csv, markdown, table_csv, timings_csv
from reproductions.chen2021.tally import CaseTally

TABLE_FILE = "table.md"
PICTURES_FOLDER = "pictures"
SHOWN_SEED = 0


def write_study(out: Path, study: Study, counted: Sequence[CaseTally], on_progress: Callable[[int, int], None]) -> None:
    """Write tables and pictures, those of the first seed's maps, all or none."""
    files = {
        out / TABLE_FILE: markdown(study, counted).encode(),
        out / "table.csv": table_csv(counted).encode(),
        out / "answers.csv": answers_csv(study).encode(),
        out / "timings.csv": timings_csv(study).encode(),
    }
    total = len(PLACES) + sum(not case.team for case in CASES) + 2
    for number, (name, data) in enumerate(_pictures(out, study, counted), start=1):
        files[out / PICTURES_FOLDER / f"{name}.png"] = data
        on_progress(number, total)
    write_files_atomically(files)


def _pictures(out: Path, study: Study, counted: Sequence[CaseTally]) -> Iterator[tuple[str, bytes]]:
    from reproductions.chen2021.charts import index_figure, right_figure
    from reproductions.chen2021.pictures import case_figure, maps_figure

    for place in PLACES:
        maps = read_maps(maps_file(out, place, SHOWN_SEED))
        yield f"maps-{place}", figure_png(maps_figure(place, maps))
        for case in (case for case in CASES if case.place == place and not case.team):
            yield _stem(case), figure_png(case_figure(case, maps, study, SHOWN_SEED))
    yield "right", figure_png(right_figure(counted))
    yield "index", figure_png(index_figure(study))


def _stem(case: Case) -> str:
    return case.name.replace(" ", "-").replace(",", "")
