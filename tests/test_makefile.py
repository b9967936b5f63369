"""The Makefile on a fresh clone, by ``make -n``, without installing."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
VERBS = (
    *(
        "run",
        "sim",
        "merge",
        "score",
        "thesis",
        "thesis-quick",
        "install",
        "test",
        "test-bounds",
        "regression",
        "regression-update",
    ),
    *("check", "study", "bench", "lock", "clean", "help"),
)


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    for name in ("Makefile", "requirements.lock", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    return tmp_path


def make(folder: Path, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    # Under `make test`, the outer make's own variables would reach the inner one.
    inherited = {key: value for key, value in os.environ.items() if not key.startswith(("MAKE", "MFLAGS"))}
    return subprocess.run(
        ["make", *words], cwd=folder, env=inherited | environment, capture_output=True, text=True, check=False
    )


def fake_python(folder: Path, version: str) -> Path:
    python = folder / "python of mine"
    python.write_text(f"#!/bin/sh\necho {version}\n")
    python.chmod(python.stat().st_mode | stat.S_IXUSR)
    return python


def install_once(folder: Path) -> None:
    stamp = folder / ".venv" / ".installed"
    stamp.parent.mkdir()
    stamp.touch()


def job(folder: Path, *words: str, **environment: str) -> list[list[str]]:
    """The commands of the job as the shell will split them."""
    install_once(folder)
    done = make(folder, "-n", *words, **environment)
    assert done.returncode == 0, done.stderr
    return [shlex.split(line) for line in done.stdout.splitlines()]


def test_the_job_by_default(clone: Path) -> None:
    _, simulate, merge, score = job(clone)
    options = "--robots 3 --seed 6 --duration 120 --noise 1 --out runs/office-3-6"
    assert " ".join(simulate[1:]) == f"simulate office {options}"
    assert " ".join(merge[1:]) == "merge runs/office-3-6 --method quilt || test $? -eq 1"
    assert score[1:] == ["score", "runs/office-3-6"]
    assert {command[0] for command in (simulate, merge, score)} == {".venv/bin/mapquilt"}


def test_variables_pass_through(clone: Path) -> None:
    given = ("world=maze", "robots=5", "seed=11", "duration=60", "noise=0.5", "method=orb", "out=here")
    _, simulate, merge, score = job(clone, *given)
    assert " ".join(simulate[1:]) == "simulate maze --robots 5 --seed 11 --duration 60 --noise 0.5 --out here"
    assert merge[2:5] == ["here", "--method", "orb"]
    assert score[2] == "here"


def test_the_run_folder_follows_the_variables(clone: Path) -> None:
    assert job(clone, "world=maze", "seed=1")[3][2] == "runs/maze-3-1"


def test_the_environment_does_not_leak_in(clone: Path) -> None:
    names = ("world", "robots", "seed", "duration", "noise", "method", "out", "PYTHON")
    assert job(clone, **dict.fromkeys(names, "moon")) == job_without_environment(clone)


def job_without_environment(clone: Path) -> list[list[str]]:
    return [shlex.split(line) for line in make(clone, "-n").stdout.splitlines()]


@pytest.mark.parametrize(
    "value", ["two words", "it's", 'a"b', "$(touch pwned)", "$(shell touch pwned)", "`touch pwned`", "; touch pwned #"]
)
def test_a_value_with_spaces_stays_one_word(clone: Path, value: str) -> None:
    mapquilt = clone / ".venv" / "bin" / "mapquilt"
    install_once(clone)
    mapquilt.parent.mkdir()
    mapquilt.write_text('#!/bin/sh\nprintf "%s\\n" "$2" >> seen\n')
    mapquilt.chmod(0o755)
    assert make(clone, f"world={value}").returncode == 0
    before, world, out, again = (clone / "seen").read_text().splitlines()
    assert (world, before, out, again) == (value, *[f"runs/{value}-3-6"] * 3)
    assert not (clone / "pwned").exists()


@pytest.mark.parametrize(("status", "stops"), [(0, False), (1, False), (2, True), (70, True), (130, True)])
def test_a_refusal_does_not_stop_the_job(clone: Path, status: int, stops: bool) -> None:
    mapquilt = clone / ".venv" / "bin" / "mapquilt"
    install_once(clone)
    mapquilt.parent.mkdir()
    mapquilt.write_text(f'#!/bin/sh\necho "$1" >> seen\n[ "$1 $5" != "merge " ] || exit {status}\n')
    mapquilt.chmod(0o755)
    done = make(clone)
    assert (done.returncode != 0) == stops
    assert (clone / "seen").read_text().split() == ["merge", "simulate", "merge"] + ["score"] * (not stops)


def test_a_method_that_does_not_exist_stops_the_job_before_it_simulates(clone: Path) -> None:
    mapquilt = clone / ".venv" / "bin" / "mapquilt"
    install_once(clone)
    mapquilt.parent.mkdir()
    mapquilt.write_text(f'#!/bin/sh\necho "$1" >> seen\nPYTHONPATH={ROOT} exec {sys.executable} -m mapquilt "$@"\n')
    mapquilt.chmod(0o755)
    done = make(clone, "method=typo")
    assert done.returncode != 0
    assert "typo" in done.stderr
    assert (clone / "seen").read_text().split() == ["merge"]
    assert not (clone / "runs").exists()


def test_an_unknown_variable_is_refused(clone: Path) -> None:
    done = make(clone, "-n", "wrold=office")
    assert done.returncode != 0
    assert done.stdout == ""
    assert re.fullmatch(r".*unknown variable wrold; known are: world .*\n", done.stderr)


def test_a_line_break_in_a_value_is_refused(clone: Path) -> None:
    done = make(clone, "-n", "out=x\ntouch pwned")
    assert done.returncode != 0
    assert re.fullmatch(r".*the value of out holds a line break.*\n", done.stderr)


@pytest.mark.parametrize("version", ["3.10.4", "3.12.1", "2.7.18", "3.1.1"])
def test_a_wrong_python_gives_one_line(clone: Path, version: str) -> None:
    done = make(clone, f"PYTHON={fake_python(clone, version)}")
    assert done.returncode != 0
    assert done.stdout == ""
    assert re.fullmatch(
        rf".*needs Python 3\.11, but .*python of mine is Python {re.escape(version)}; .*\n", done.stderr
    )
    assert not (clone / ".venv").exists()


def test_a_missing_python_gives_one_line(clone: Path) -> None:
    done = make(clone, "PYTHON=no-such-python")
    assert done.returncode != 0
    assert re.fullmatch(r".*needs Python 3\.11, but no-such-python is not a Python that runs; .*\n", done.stderr)


def test_a_right_python_is_used(clone: Path) -> None:
    done = make(clone, "-n", "install", f"PYTHON={fake_python(clone, '3.11.9')}")
    assert done.returncode == 0
    steps = done.stdout.splitlines()
    assert "--require-hashes --no-deps -r requirements.lock" in steps[2]
    assert "--no-deps --no-build-isolation --editable ." in steps[3]
    assert steps[-1] == "touch .venv/.installed"  # made last: an install that broke off is done again


@pytest.mark.parametrize("changed", ["requirements.lock", "pyproject.toml"])
def test_an_install_is_done_once_and_again_after_a_change(clone: Path, changed: str) -> None:
    install_once(clone)
    assert "pip" not in make(clone, "-n", "install").stdout
    later = (clone / ".venv" / ".installed").stat().st_mtime + 10
    os.utime(clone / changed, (later, later))
    assert "pip" in make(clone, "-n", "install").stdout


@pytest.mark.parametrize("verb", VERBS)
def test_verbs_are_phony(clone: Path, verb: str) -> None:
    (clone / verb).mkdir()
    done = make(clone, "-n", verb)
    assert done.returncode == 0
    assert "up to date" not in done.stdout
    assert "Nothing to be done" not in done.stdout


def test_help_names_every_verb_and_variable(clone: Path) -> None:
    shown = make(clone, "help").stdout
    for word in (*VERBS, "world", "robots", "seed", "duration", "noise", "method", "out", "PYTHON"):
        assert word in shown


def test_ci_calls_what_the_readme_says() -> None:
    script = (ROOT / ".ci" / "run").read_text()
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
    assert re.findall(r"^make ([\w-]+)", script, flags=re.MULTILINE) == [
        "check",
        "test-bounds",
        "regression",
        "test",
    ]
