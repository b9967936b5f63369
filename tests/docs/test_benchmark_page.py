"""The script of docs/benchmark.md recomputes the table from pairs.csv alone."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import command
from tests.mapquilt.dataset.conftest import SPEC

PAGE = Path(__file__).parents[2] / "docs/benchmark.md"


@pytest.mark.slow
def test_the_script_prints_the_numbers_of_the_summary(tmp_path: Path) -> None:
    (script,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)
    (tmp_path / "recompute.py").write_text(script, encoding="utf-8")
    (tmp_path / "spec.yaml").write_text(SPEC.replace("duration: 1}", "duration: 12}"))
    data, out = tmp_path / "data", tmp_path / "bench"
    assert command("dataset", "make", tmp_path / "spec.yaml", "--out", data, "--workers", 1) == 0
    options = ("--method", "orb", "--method", "stitching", "--as-published", "--pictures", 0)
    assert command("benchmark", "--dataset", data, *options, "--out", out) == 0
    call = [sys.executable, "recompute.py", "bench/pairs.csv"]
    printed = subprocess.run(call, cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    summary = json.loads((out / "summary.json").read_text())
    strata = {(row["group"], row["stratum"], row["method"]): row for row in summary["strata"]}
    lines = []
    for method in summary["methods"]:
        positives, every = strata["positives", "all", method], strata["every pair", "all", method]
        shares = {"right": positives["right"], "true accepts": positives["true_accepts"]}
        for name, share in {**shares, "false accepts": every["false_accepts"]}.items():
            low, high = (100.0 * share["interval"][end] for end in ("low", "high"))
            lines.append(f"{method} {name} {share['count']} of {share['of']} ({low:.1f} to {high:.1f} %)")
    assert sum(int(line.split(" of ")[0].split()[-1]) for line in lines) > 0
    assert printed.splitlines() == lines
