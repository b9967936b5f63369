"""``mapquilt score``: compare a merged run with its truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from mapquilt.cli.exit_status import ALL_MERGED
from mapquilt.cli.options.workers import WorkersOption, chosen_workers
from mapquilt.cli.tables import print_table
from mapquilt.dataset.answers import outcome_table, score_samples
from mapquilt.dataset.manifest import is_dataset
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.formatting import error_texts, number_text, outcome_text
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
        table.caption = f"{run}: {len(scores)} samples scored in place; mapquilt report {run} shows them"
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
    words = ", ".join(f"{counts[name]} {name.replace('_', ' ')}" for name in names)
    table.caption = f"{counts['pairs']} pairs: {words}"
    if any(", " in outcome_text(one) for one in score.pairs):
        table.caption += (
            "\ndistorted: no transform fits these maps well, so that a right answer may miss by chance"
            "\nambiguous: several placements fit these maps, and nothing in them tells which is right"
        )
    for group in score.merged:
        table.caption += (
            f"\nmerged map of {len(group.maps)}, frame of {group.reference}: "
            f"free IoU {group.quality.iou_free:.3f}, walls F1 {group.quality.f1_walls:.3f}"
        )
    return table


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
