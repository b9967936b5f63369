"""Content of a report on a data set."""

from __future__ import annotations

from pathlib import Path

from mapquilt.dataset.card import FIGURE_FILE
from mapquilt.dataset.loader import DatasetPair, load_dataset
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, GroundTruth, PairInfo
from mapquilt.json_file import read_record
from mapquilt.report.content import Content, Picture
from mapquilt.report.of_run import run_answers
from mapquilt.runs.folder import MERGE_FILE, RUN_FILE


def dataset_content(folder: Path) -> Content:
    """Read a finished data set, with the answers of the samples that were merged in place.

    Raises ``ValueError`` or ``OSError`` naming the file that is wrong.
    """
    dataset = load_dataset(folder)
    answers: list[EvaluatedPair] = []
    merged = 0
    for sample in dataset.samples:
        record = read_record(sample.folder / RUN_FILE, "run")
        merged += (sample.folder / MERGE_FILE).is_file()
        answers += run_answers(sample.folder, record, sample.name)
    negatives = [pair for pair in dataset.pairs if pair.target_from_source is None]
    answers += [_negative(pair) for pair in negatives]
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
                "Properties",
                figures.read_bytes(),
                "Histograms of true overlap, distortion, scale and residual of the pairs",
                "True overlap, distortion, scale and residual.",
            )
        ]
        if figures.is_file()
        else [],
        notes=[] if merged else ["No sample has been merged in place; `mapquilt merge DATASET` does it."],
    )


def _negative(pair: DatasetPair) -> EvaluatedPair:
    info = PairInfo(
        name=pair.name,
        target=pair.target_path.parent.name,
        source=pair.source_path.parent.name,
        world=pair.world,
        noise=pair.noise,
        mission=pair.mission,
        target_file=pair.target_path,
        source_file=pair.source_path,
    )
    return EvaluatedPair(info, GroundTruth(None, overlap=0.0))
