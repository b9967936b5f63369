"""``mapquilt score``: compare a merged run with its truth."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from mapping.wording import counted
from mapquilt.cli.exit_status import ALL_MERGED
from mapquilt.cli.options.workers import WorkersOption, chosen_workers
from mapquilt.cli.tables import print_table
from mapquilt.dataset.answers import outcome_table, score_samples, wrong_verdicts
from mapquilt.dataset.manifest import is_dataset
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.formatting import error_texts, number_text, outcome_notes, outcome_text
from mapquilt.jobs.progress import count_progress
from mapquilt.jobs.runner import Runner
from mapquilt.runs import folder as run_folder
from mapquilt.scoring.run_score import RunScore
from mapquilt.scoring.score_file import score_run
from mapquilt.viz.text_table import plain_table


def score(
    run: Annotated[Path, typer.Argument(metavar="RUN | DATASET", help="Run folder, or data set, that is merged.")],
    workers: WorkersOption = None,
) -> int:
    """Compare a run's merge with the truth; write score.json and overview.png. In a data set, do so for each sample.

    Example: mapquilt score runs/office
    """
    if is_dataset(run):
        with Runner(chosen_workers(workers, None)) as runner, count_progress("samples") as on_progress:
            scores = score_samples(run, runner, on_progress)
        table = outcome_table(scores)
        done = f"{run}: {counted(len(scores), 'sample')} scored in place; mapquilt report {run} shows them"
        table.caption = "\n".join((*wrong_verdicts(scores), done))
        print_table(table)
        return ALL_MERGED
    print_table(score_table(score_run(run_folder.require_run(run))))
    return ALL_MERGED


def score_table(score: RunScore) -> Table:
    """Tabulate each pair's outcome, true overlap and errors, and the quality of each merged map."""
    table = plain_table(
        *(("pair", False), ("outcome", False), ("overlap", True), ("yaw\n[deg]", True), ("scale\n[%]", True)),
        *(("error\n[m]", True), ("error\n[cells]", True), ("AI", True)),
    )
    for one in score.pairs:
        table.add_row(*_score_row(one))
    counts = score.summary()
    names = ("true_accepts", "false_accepts", "false_rejects", "true_rejects")
    words = ", ".join(counted(counts[name], name.replace("_", " ").removesuffix("s")) for name in names)
    table.caption = f"{counted(counts['pairs'], 'pair')}: {words}"
    table.caption = "\n".join((table.caption, *outcome_notes(score.pairs)))
    for group in score.merged:
        table.caption += (
            f"\n{_merged_maps(group.maps)}, frame of {group.reference}: "
            f"free IoU {group.quality.iou_free:.3f}, walls F1 {group.quality.f1_walls:.3f}"
        )
    return table


def _merged_maps(names: Sequence[str]) -> str:
    """Name a merged map by its number of maps, or by its only one."""
    return f"merged map of {len(names)}" if len(names) > 1 else f"{names[0]} alone"


def _score_row(one: EvaluatedPair) -> tuple[str, ...]:
    index = None if one.evidence is None else one.evidence.acceptance_index
    overlap = one.truth.overlap
    return (
        f"{one.pair.target} <- {one.pair.source}",
        outcome_text(one),
        "-" if overlap is None else f"{100 * overlap:.0f} %",
        *error_texts(one),
        number_text(index, 3),
    )
