"""A data set: what there is to report of it."""

from __future__ import annotations

from pathlib import Path

from mapquilt.dataset.card import FIGURE_FILE
from mapquilt.dataset.loader import load_dataset
from mapquilt.json_file import read_record
from mapquilt.report.answer import ReportAnswer
from mapquilt.report.content import Content, Picture
from mapquilt.report.of_run import run_answers
from mapquilt.runs.folder import MERGE_FILE, RUN_FILE


def dataset_content(folder: Path) -> Content:
    """A finished data set; samples that were merged in place tell how. Raises ``ValueError`` or ``OSError`` naming the
    file that is wrong."""
    dataset = load_dataset(folder)
    answers: list[ReportAnswer] = []
    merged = 0
    for sample in dataset.samples:
        record = read_record(sample.folder / RUN_FILE, "run")
        merged += (sample.folder / MERGE_FILE).is_file()
        answers += run_answers(sample.folder, record, f"{sample.name}: ")
    negatives = [pair for pair in dataset.pairs if pair.target_from_source is None]
    answers += [
        ReportAnswer(
            pair.name,
            pair.mission,
            pair.target_path,
            pair.source_path,
            world=pair.world,
            noise=pair.noise,
            overlap=0.0,
            negative=True,
        )
        for pair in negatives
    ]
    figures = folder / FIGURE_FILE
    return Content(
        kind="data set",
        name=folder.resolve().name,
        settings={
            "samples": f"{len(dataset.samples)}, of which {merged} were merged",
            "pairs": f"{len(answers) - len(negatives)}, and {len(negatives)} of two worlds",
            "splits": ", ".join(sorted({sample.split for sample in dataset.samples})),
        },
        answers=tuple(answers),
        pictures=[
            Picture(
                "What was made",
                figures.read_bytes(),
                "Histograms of true overlap, distortion, scale and residual of the pairs",
                "True overlap, distortion, scale and residual of what was made.",
            )
        ]
        if figures.is_file()
        else [],
        notes=[] if merged else ["No sample has been merged in place; mapquilt merge does it, one by one."],
    )
