"""A run, and a sample of a data set: what there is to report of them."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from mapping.geometry.similarity2 import Similarity2
from mapquilt.evaluation.run_score import score_answer
from mapquilt.json_file import read_record, similarity_from_record
from mapquilt.merging.merge_file import load_answer
from mapquilt.merging.merge_schema import read_merge_record
from mapquilt.report.answer import ReportAnswer
from mapquilt.report.charts import stage_chart
from mapquilt.report.content import Content, Picture
from mapquilt.runs import folder as run_folder
from mapquilt.runs.truth_file import load_truth

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
        "How much of the free floor had been seen as time went by.",
    ),
)


def run_content(folder: Path) -> Content:
    """A run, merged or not. Raises ``ValueError`` or ``OSError`` naming the file that is wrong."""
    record = read_record(run_folder.require_run(folder) / run_folder.RUN_FILE, "run")
    timings = run_folder.read_timings(folder)
    return Content(
        kind="run",
        name=folder.resolve().name,
        settings=run_settings(record),
        answers=tuple(run_answers(folder, record, "")),
        pictures=[
            Picture(heading, (folder / name).read_bytes(), alt, caption)
            for name, heading, alt, caption in PICTURES
            if (folder / name).is_file()
        ],
        charts=[stage_chart(timings)] if timings else [],
        notes=[] if (folder / run_folder.MERGE_FILE).is_file() else ["This run has not been merged yet."],
    )


def run_settings(record: dict[str, Any]) -> dict[str, str]:
    """What a run was made with, in words."""
    low, high = record["disguise"]["scale"]
    return {
        "world": f"{record['world']}, seed {record['seed']}",
        "team": f"{record['robots']} robots, {record['duration_s']:g} s",
        "noise level": f"{record['noise']:g}",
        "poses": record["poses"],
        "cells": f"{record['resolution_m']:g} m",
        "true metres per stated metre": f"{low:g} to {high:g}",
        "generator": record["generator"],
    }


def run_answers(folder: Path, record: dict[str, Any], prefix: str) -> list[ReportAnswer]:
    """An answer for each pair, in the order of the merge, or of the truth where nothing was merged."""
    truth, files = read_record(folder / run_folder.TRUTH_FILE, "truth"), _map_files(folder)
    merge_path = folder / run_folder.MERGE_FILE
    merged = read_merge_record(merge_path) if merge_path.is_file() else None
    answers = {} if merged is None else {(pair["target"], pair["source"]): pair for pair in merged["pairs"]}
    scores = {} if merged is None else _scores(folder)
    found = []
    for pair in truth["pairs"]:
        key = pair["target"], pair["source"]
        if merged is not None and key not in answers:
            raise ValueError(f"{merge_path}: tells nothing of the pair {key[0]}, {key[1]}")
        answer, score = answers.get(key), scores.get(key)
        error = (score or {}).get("error") or {}
        evidence, others = (answer or {}).get("evidence") or {}, (answer or {}).get("alternatives") or []
        found.append(
            ReportAnswer(
                pair=f"{prefix}{key[0]} and {key[1]}",
                method="" if merged is None else merged["method"],
                world=record["world"],
                noise=record["noise"],
                overlap=pair["overlap"],
                negative=pair["overlap"] == 0.0,
                identifiable=pair["identifiable"],
                bent=bool((score or {}).get("bent")),
                accepted=None if answer is None else answer["accepted"],
                right=bool((score or {}).get("right")),
                confidence=None if answer is None else answer["confidence"],
                rotation_deg=error.get("rotation_deg"),
                scale_percent=error.get("scale_percent"),
                displacement_m=error.get("displacement_m"),
                displacement_cells=error.get("displacement_cells"),
                reason=None if answer is None else answer["reason"],
                score=evidence.get("score"),
                runner_up_score=others[0]["score"] if others else evidence.get("second_best_score") or None,
                cluster=record["mission"],
                target=files[key[0]],
                source=files[key[1]],
                answer=_place(None if answer is None else answer["target_from_source"]),
                truth=None if pair["overlap"] == 0.0 else _place(pair["target_from_source"]),
                runner_up=_place(others[0]["target_from_source"] if others else None),
            )
        )
    return found


def _map_files(folder: Path) -> dict[str, Path]:
    maps = read_record(folder / run_folder.MAPS_FILE, "maps")["maps"]
    return {entry["name"]: folder / entry["file"] for entry in maps}


def _scores(folder: Path) -> dict[tuple[str, str], dict[str, Any]]:
    """From score.json, or counted now where the run was merged and not scored yet."""
    path = folder / run_folder.SCORE_FILE
    if path.is_file():
        pairs = read_record(path, "score")["pairs"]
    else:
        answer = load_answer(folder / run_folder.MERGE_FILE)
        score = score_answer(run_folder.load_maps(folder), load_truth(folder / run_folder.TRUTH_FILE), answer)
        pairs = [dataclasses.asdict(pair) for pair in score.pairs]
    return {(pair["target"], pair["source"]): pair for pair in pairs}


def _place(record: dict[str, float] | None) -> Similarity2 | None:
    return None if record is None else similarity_from_record(record)
