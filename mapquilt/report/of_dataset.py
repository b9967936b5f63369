"""Content of a report on a data set."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from mapquilt.dataset.card import FIGURE_FILE, natural_order, overlap_stratum
from mapquilt.dataset.loader import DatasetPair, load_dataset
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, GroundTruth, PairInfo
from mapquilt.json_file import read_record
from mapquilt.report.content import Content, Picture, Sheet, own_picture
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
    figures = own_picture(folder, FIGURE_FILE)
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
                figures,
                "Histograms of true overlap, distortion, scale and residual of the pairs",
                "True overlap, distortion, scale and residual.",
            )
        ]
        if figures is not None
        else [],
        sheets=[_strata(answers, {sample.name: sample.split for sample in dataset.samples})],
        notes=[] if merged else ["No sample has been merged in place; `mapquilt merge DATASET` does it."],
    )


def _strata(answers: Sequence[EvaluatedPair], splits: Mapping[str, str]) -> Sheet:
    """Count the pairs of each world, overlap, noise level and split."""
    keys: dict[str, Callable[[EvaluatedPair], str | None]] = {
        "world": lambda one: one.pair.world,
        "true overlap": lambda one: None if one.negative else overlap_stratum(one.truth.overlap or 0.0),
        "noise level": lambda one: None if one.pair.noise is None else f"{one.pair.noise:g}",
        "split": lambda one: splits.get(one.pair.suite),
    }
    rows: list[list[str]] = []
    for title, key in keys.items():
        groups: dict[str, list[EvaluatedPair]] = {}
        for one in answers:
            groups.setdefault(key(one) or "", []).append(one)
        rows += [[f"{title}: {name}", *_counts(groups[name])] for name in sorted(groups, key=natural_order) if name]
    columns = ("pairs", "one right answer", "several fit", "nothing in common", "median overlap", "median residual [m]")
    caption = (
        "Pairs whose maps fit at exactly one placement, at several, or at none; the residual is what the best true "
        "transform leaves, because maps bend."
    )
    return Sheet("Pairs by stratum", caption, [("stratum", False), *((name, True) for name in columns)], rows)


def _counts(pairs: Sequence[EvaluatedPair]) -> list[str]:
    one, none = sum(pair.identifiable for pair in pairs), sum(pair.negative for pair in pairs)
    overlaps = [pair.truth.overlap for pair in pairs if pair.truth.overlap is not None]
    residuals = [pair.truth.residual_m for pair in pairs if pair.truth.residual_m is not None]
    return [
        str(len(pairs)),
        str(one),
        str(len(pairs) - one - none),
        str(none),
        f"{100.0 * float(np.median(overlaps)):.0f} %" if overlaps else "-",
        f"{float(np.median(residuals)):.3f}" if residuals else "-",
    ]


def _negative(pair: DatasetPair) -> EvaluatedPair:
    info = PairInfo(
        name=pair.name,
        target=pair.target_path.parent.name,
        source=pair.source_path.parent.name,
        world=pair.world,
        noise=pair.noise,
        poses=pair.poses,
        mission=pair.mission,
        target_file=pair.target_path,
        source_file=pair.source_path,
    )
    return EvaluatedPair(info, GroundTruth(None, overlap=0.0))
