"""The numbers of docs/truth.md are those that its commands print."""

import re
import subprocess
import sys
from pathlib import Path

from tests.conftest import command

PAGE = Path(__file__).parents[2] / "docs" / "truth.md"


def test_the_worked_example_holds(tmp_path):
    made = ("simulate", "office", "--robots", 3, "--seed", 2, "--poses", "odometry", "--out", tmp_path / "run")
    assert command(*made) == 0
    script = PAGE.with_name("truth_example.py")
    arguments = [sys.executable, str(script), str(tmp_path / "run"), str(tmp_path / "truth.png")]
    done = subprocess.run(arguments, check=True, capture_output=True, text=True, cwd=PAGE.parents[1])
    text = PAGE.read_text()
    numbers = re.findall(r"path ([\d.]+) m; drift at its end ([\d.]+) m, ([\d.]+) degrees", done.stdout)[0]
    numbers += tuple(re.findall(r"distortion ([\d.]+) m", done.stdout))
    numbers += re.findall(r"overlap (\d+) %, (\d+) common wall cells, residual ([\d.]+) m", done.stdout)[0]
    numbers += tuple(re.findall(r"misses it by ([\d.]+) m", done.stdout))
    assert len(numbers) == 9
    missing = [number for number in numbers if f"{number} " not in text]
    assert missing == []
