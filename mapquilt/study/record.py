"""A study as JSON: its plan, its trials, and what was counted."""

from __future__ import annotations

import dataclasses
from typing import Any

from mapquilt.study.plan import Method, StudyPlan, plan_study
from mapquilt.study.results import StudyResults
from mapquilt.study.trial import Failure, MissionTrials, PairTrial, TeamTrial

SCHEMA = "mapquilt-study/1"
PUBLISHED = " as published"


def plan_from_record(record: dict[str, Any]) -> StudyPlan:
    """The plan of ``StudyPlan.record``. Raises ``ValueError`` naming what cannot be planned any more."""
    vary = [f"{one['name']}={','.join(one['values'])}" for one in record["varied"]]
    fixed = [f"{name}={value}" for name, value in record["fixed"].items()]
    methods = [Method(title.removesuffix(PUBLISHED), title.endswith(PUBLISHED)) for title in record["methods"]]
    return plan_study(
        None, vary, fixed, methods, record["worlds"], record["missions"], record["seed"], record["min_overlap"]
    )


def trials_record(trials: MissionTrials) -> dict[str, Any]:
    """One mission's trials; its maps are files of their own."""
    return {
        "pairs": [dataclasses.asdict(one) for one in trials.pairs],
        "teams": [dataclasses.asdict(one) for one in trials.teams],
        "failures": [dataclasses.asdict(one) for one in trials.failures],
    }


def trials_from_record(record: dict[str, Any]) -> MissionTrials:
    """The trials of ``trials_record``."""
    return MissionTrials(
        pairs=[PairTrial(**_with_tuples(one)) for one in record["pairs"]],
        teams=[TeamTrial(**_with_tuples(one)) for one in record["teams"]],
        failures=[Failure(**_with_tuples(one)) for one in record["failures"]],
    )


def _with_tuples(record: dict[str, Any]) -> dict[str, Any]:
    return {name: tuple(value) if isinstance(value, list) else value for name, value in record.items()}


def study_record(results: StudyResults) -> dict[str, Any]:
    """What study.json holds; no times."""
    return {
        "schema": SCHEMA,
        **results.plan.record(),
        "cells": [_with_lists(dataclasses.asdict(cell)) for cell in results.cells],
        "tests": [_with_lists(dataclasses.asdict(test)) | {"verdict": test.verdict} for test in results.tests],
        "failures": [_with_lists(dataclasses.asdict(failure)) for failure in results.failures],
    }


def _with_lists(record: dict[str, Any]) -> dict[str, Any]:
    return {name: list(value) if isinstance(value, tuple) else value for name, value in record.items()}
