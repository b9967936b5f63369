"""Content of a report on a run, or on a sample of a data set."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mapquilt.evaluation.evaluated_pair import EvaluatedPair, PairInfo
from mapquilt.json_file import read_record
from mapquilt.merging.merge_file import load_answer
from mapquilt.report.charts import stage_chart
from mapquilt.report.content import Content, Picture, own_picture
from mapquilt.report.mission_view import mission_view
from mapquilt.runs import folder as run_folder
from mapquilt.runs.truth_file import load_truth
from mapquilt.scoring.run_score import evaluate_run_pair, run_ground_truth
from sim.mission.file import load_mission

PICTURES = (
    (
        run_folder.OVERVIEW_PICTURE,
        "The run",
        "The world with the robots' true paths, the merged map, its walls over the true ones, and each robot's own map",
        "Above: the world with the true paths, the merged map, and its walls over the true ones in grey. "
        "Below: the maps as the merger got them.",
    ),
    (
        run_folder.COVERAGE_PICTURE,
        "Coverage",
        "Share of the free floor seen over time, by each robot and by the team",
        "Share of the free floor that was observed over time.",
    ),
)


def run_content(folder: Path) -> Content:
    """Read a run, merged or not. Raises ``ValueError`` or ``OSError`` naming the file that is wrong."""
    record = read_record(run_folder.require_run(folder) / run_folder.RUN_FILE, "run")
    timings = run_folder.read_timings(folder)
    mission = None if record["mission"] is None else load_mission(run_folder.mission_folder(folder))
    return Content(
        kind="run",
        name=folder.resolve().name,
        settings=run_settings(record),
        answers=tuple(run_answers(folder, record)),
        pictures=[
            Picture(heading, data, alt, caption)
            for name, heading, alt, caption in PICTURES
            if (data := own_picture(folder, name)) is not None
        ],
        charts=[stage_chart(timings)] if timings else [],
        notes=[] if (folder / run_folder.MERGE_FILE).is_file() else ["This run has not been merged yet."],
        mission=None if mission is None else mission_view(mission),
    )


def run_settings(record: dict[str, Any]) -> dict[str, str]:
    """Describe the settings of a run."""
    low, high = record["frame_perturbation"]["scale"]
    return {
        "world": f"{record['world']}, seed {record['seed']}",
        "team": f"{record['robots']} robots, {record['duration_s']:g} s",
        "noise level": "recorded logs" if record["noise"] is None else f"{record['noise']:g}",
        "poses": record["poses"],
        "cells": f"{record['resolution_m']:g} m",
        "true metres per stated metre": f"{low:g} to {high:g}",
        "generator": record["generator"],
    }


def run_answers(folder: Path, record: dict[str, Any], suite: str = "") -> list[EvaluatedPair]:
    """Evaluate each pair of a run, in the order of the truth; pairs without an answer if it was not merged.

    Raises ``ValueError`` if the merge lacks a pair.
    """
    truth, files = load_truth(folder / run_folder.TRUTH_FILE), run_folder.map_files(folder)
    merge_path = folder / run_folder.MERGE_FILE
    merged = load_answer(merge_path) if merge_path.is_file() else None
    answers = {} if merged is None else {(pair.target, pair.source): pair for pair in merged.pairs}
    maps = None if merged is None else run_folder.load_maps(folder)
    found = []
    for target, source in truth.pairs:
        info = PairInfo(
            name=f"{target} and {source}",
            target=target,
            source=source,
            suite=suite,
            world=record["world"],
            noise=record["noise"],
            poses=record["poses"],
            mission=record["mission"],
            target_file=files[target],
            source_file=files[source],
        )
        if merged is None or maps is None:
            found.append(EvaluatedPair(info, run_ground_truth(truth, target, source)))
        elif (target, source) in answers:
            found.append(evaluate_run_pair(maps, truth, answers[target, source], info, merged.method))
        else:
            raise ValueError(f"{merge_path}: has no pair {target}, {source}; merge the run again")
    return found
