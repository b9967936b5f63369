"""Files of a finished reproduction."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from mapping.io.transaction import write_files_atomically
from mapquilt.viz.png import figure_png
from reproductions.chen2021.cases import SETS
from reproductions.chen2021.make import Study
from reproductions.chen2021.methods import CORRECTED, PLAIN
from reproductions.chen2021.missions import Hall
from reproductions.chen2021.table import answers_csv, markdown, table_csv
from reproductions.chen2021.tally import Tallies

TABLE_FILE = "table.md"
PICTURES_FOLDER = "pictures"
PICTURES = 4
SHOWN = SETS[2]
"""The case whose maps the pictures show."""


def write_study(out: Path, study: Study, counted: Tallies, on_progress: Callable[[int, int], None]) -> None:
    """Write tables and pictures, all or none."""
    files = {
        out / TABLE_FILE: markdown(study, counted).encode(),
        out / "table.csv": table_csv(counted).encode(),
        out / "answers.csv": answers_csv(study).encode(),
    }
    for number, (name, data) in enumerate(_pictures(study, counted), start=1):
        files[out / PICTURES_FOLDER / f"{name}.png"] = data
        on_progress(number, PICTURES)
    write_files_atomically(files)


def _pictures(study: Study, counted: Tallies) -> Iterator[tuple[str, bytes]]:
    from reproductions.chen2021.charts import ablation_figure, cases_figure
    from reproductions.chen2021.pictures import matches_figure, steps_figure

    yield "cases", figure_png(cases_figure(counted))
    yield "ablation", figure_png(ablation_figure(counted))
    seed = telling_seed(study)
    pair = Hall(seed).pair(SHOWN.condition)
    answers = [one for one in study.answers if (one.trial, one.seed, one.run) == (SHOWN.name, seed, 0)]
    yield "steps", figure_png(steps_figure(SHOWN, pair, seed))
    yield "matches", figure_png(matches_figure(SHOWN, pair, answers, seed))


def telling_seed(study: Study) -> int:
    """Return the first seed at which SIFT fails on the shown case and the correction does not; 0 if there is none."""
    right = {
        (one.seed, one.method): one.right
        for one in study.answers
        if one.trial == SHOWN.name and one.method in (PLAIN, CORRECTED) and one.run == 0
    }
    telling = (seed for seed in range(study.seeds) if right[seed, CORRECTED] and not right[seed, PLAIN])
    return next(telling, 0)
