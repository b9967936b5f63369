"""Merge and score every sample of a data set in place."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from rich.table import Table

from mapping.io.shape import require_shape
from mapping.io.transaction import refuse_links
from mapping.wording import counted
from mapquilt.dataset.card import OVERLAP_BOUNDS, overlap_stratum
from mapquilt.dataset.loader import check_files, load_dataset
from mapquilt.dataset.manifest import MANIFEST_FILE
from mapquilt.evaluation.aggregation import outcome_counts
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.formatting import outcome_notes, outcome_text
from mapquilt.jobs.journal import JOURNAL_FILE, TASKS_FILE, Entry, Journal, counting, job_folder, remove_job
from mapquilt.jobs.runner import Progress, Runner, no_progress
from mapquilt.merging.merge_folder import merge_run
from mapquilt.runs.folder import MERGE_FILE
from mapquilt.scoring.score_file import score_run
from mapquilt.viz.text_table import plain_table
from merge.settings import MergeSettings

MERGE_FOLDER = ".merge"
"""Hidden folder of a data set that holds an unfinished merge of its samples."""


@dataclass(frozen=True)
class MergeTask:
    """Name a sample's folder, its files with their hashes, and how it is merged."""

    folder: Path
    digests: Mapping[Path, str]
    settings: MergeSettings
    seed: int


def merge_samples(
    folder: Path, settings: MergeSettings, seed: int, runner: Runner, on_progress: Progress = no_progress
) -> dict[str, tuple[str, ...]]:
    """Merge the maps of each sample in its own folder, and return the maps that were left out, by sample.

    An older merge is replaced, and an interrupted one continues. Workers of a cluster must see the folder. Raises the
    first error of a sample, such as ``ValueError`` if a file of it is not as it was made, or lies behind a link.
    """
    folder = folder.resolve()
    samples, work = load_dataset(folder).samples, folder / MERGE_FOLDER
    for sample in samples:
        refuse_links(folder, sample.folder)
    tasks = [MergeTask(sample.folder, sample.digests(), settings, seed) for sample in samples]
    content = {"settings": repr(settings), "seed": seed, "data": file_digest(folder / MANIFEST_FILE)}
    with job_folder(work, "merge of mapquilt", TASKS_FILE, json.dumps(content, indent=1)):
        journal = Journal[MergeTask](work / JOURNAL_FILE, lambda task: task.folder.name, _check_entry)
        entries = journal.run(runner, merge_sample, tasks, _entry, _is_whole, counting(on_progress, len(tasks)))
        left_out = {name: tuple(entry["left_out"]) for name, entry in entries.items()}
    remove_job(work, TASKS_FILE)
    return left_out


def file_digest(file: Path) -> str:
    return sha256(file.read_bytes()).hexdigest()


def _entry(task: MergeTask, result: tuple[str, ...] | BaseException) -> Entry:
    if isinstance(result, BaseException):
        raise result
    return {"left_out": list(result), "merge": file_digest(task.folder / MERGE_FILE)}


def _check_entry(entry: Entry, place: str) -> None:
    require_shape(entry, {"left_out": [str], "merge": str}, place)


def _is_whole(task: MergeTask, entry: Entry) -> bool:
    merge = task.folder / MERGE_FILE
    return merge.is_file() and file_digest(merge) == entry["merge"]


def merge_sample(task: MergeTask) -> tuple[str, ...]:
    """Merge one sample in place, and return the maps that were left out."""
    check_files(task.digests)
    result, _ = merge_run(task.folder, task.settings, task.seed)
    return tuple(result.left_out)


@dataclass(frozen=True)
class ScoredSample:
    """Hold a sample's name, its split, and its pairs of different robots."""

    name: str
    split: str
    pairs: tuple[EvaluatedPair, ...]


def score_samples(folder: Path, runner: Runner, on_progress: Progress = no_progress) -> list[ScoredSample]:
    """Score each sample that is merged, and write its score.

    Raises ``ValueError`` if no sample is merged, or a file of one is not as it was made or lies behind a link.
    """
    samples = [sample for sample in load_dataset(folder).samples if (sample.folder / MERGE_FILE).is_file()]
    if not samples:
        raise ValueError(f"{folder}: no sample is merged; run mapquilt merge {folder}")
    for sample in samples:
        refuse_links(folder, sample.folder)
    scores = runner.run(score_sample, [(sample.folder, sample.digests()) for sample in samples], on_progress)
    asked = [{(pair["target"], pair["source"]) for pair in sample.record["pairs"]} for sample in samples]
    return [
        ScoredSample(sample.name, sample.split, tuple(one for one in pairs if _is_asked(one, names)))
        for sample, pairs, names in zip(samples, scores, asked, strict=True)
    ]


def score_sample(task: tuple[Path, Mapping[Path, str]]) -> tuple[EvaluatedPair, ...]:
    """Check the files of one sample by their hashes, score it in place, and return its pairs."""
    folder, digests = task
    check_files(digests)
    return score_run(folder).pairs


def _is_asked(one: EvaluatedPair, names: set[tuple[str, str]]) -> bool:
    return (one.pair.target, one.pair.source) in names or (one.pair.source, one.pair.target) in names


MOST_WRONG = 20
"""Most wrong verdicts that are listed; the report has all."""


def wrong_verdicts(scores: Sequence[ScoredSample]) -> tuple[str, ...]:
    """List the false accepts, then the false rejects, with their sample and the reason, and explain the words."""
    wrong = [
        (scored.name, one)
        for outcome in ("false accept", "false reject")
        for scored in scores
        for one in scored.pairs
        if one.outcome == outcome
    ]
    lines = [f"{name}: {one.pair.target} <- {one.pair.source}: {_verdict(one)}" for name, one in wrong[:MOST_WRONG]]
    if len(wrong) > MOST_WRONG:
        lines.append(f"and {counted(len(wrong) - MOST_WRONG, 'wrong verdict')} more")
    return (*lines, *outcome_notes(one for _, one in wrong))


def _verdict(one: EvaluatedPair) -> str:
    """Write the outcome with the error of an accepted answer, or the reason of a refusal."""
    if not one.accepted:
        return f"{outcome_text(one)}: {one.reason}"
    error = "" if one.error is None else f": off by {one.error.displacement_m:.2f} m, {one.error.rotation_deg:.1f} deg"
    return f"{outcome_text(one)}{error}"


def outcome_table(scores: Sequence[ScoredSample]) -> Table:
    """Count the outcomes of the pairs by split and by true overlap."""
    names = ("true_accepts", "false_accepts", "false_rejects", "true_rejects")
    table = plain_table(("pairs", False), ("n", True), *((name.replace("_", " "), True) for name in names))
    groups: dict[str, list[EvaluatedPair]] = {}
    for scored in sorted(scores, key=lambda one: one.split):
        groups.setdefault(f"split {scored.split}", []).extend(scored.pairs)
    every = [one for scored in scores for one in scored.pairs]
    strata = [overlap_stratum(bound) for bound in OVERLAP_BOUNDS[1:]]
    groups |= {
        f"overlap {stratum}": [one for one in every if overlap_stratum(one.truth.overlap or 0.0) == stratum]
        for stratum in strata
    }
    for title, found in {**groups, "all": every}.items():
        counts = Counter(outcome_counts(found))
        table.add_row(title, str(len(found)), *(str(counts[name]) for name in names))
    return table
