"""Studies small enough to run in a test."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from mapquilt.jobs.runner import Pool, Runner
from mapquilt.study.folder import run_study
from mapquilt.study.plan import Method, StudyPlan, plan_study
from mapquilt.study.results import StudyResults

TINY = ("robots=2", "duration=4", "starts=close")


def plan(
    *vary: str, fixed: tuple[str, ...] = TINY, methods: tuple[str, ...] = ("quilt", "orb"), **options: Any
) -> StudyPlan:
    settings = {"worlds": ("house",), "missions": 2, "seed": 3, "min_overlap": 0.15} | options
    return plan_study(None, vary, fixed, [Method(name) for name in methods], **settings)


def thread() -> Runner:
    """A runner of one thread: what a test patches in this process holds there too."""
    return Runner(start=lambda: Pool(ThreadPoolExecutor(1), lambda: 1))


def run(plan: StudyPlan, out: Path, cache: Path | None = None) -> StudyResults:
    with thread() as runner:
        return run_study(plan, out, cache, runner).results


@pytest.fixture(scope="session")
def tiny_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two missions of four seconds at two levels of noise, by two methods; not to be written to."""
    folder = tmp_path_factory.mktemp("study") / "tiny"
    run(plan("noise=0,3"), folder, folder.parent / "missions")
    return folder
