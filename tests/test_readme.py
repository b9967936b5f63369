"""The commands and the Python example of the README work."""

import gzip
import itertools
import re
import shlex
from pathlib import Path

import pytest

from mapping.io.carmen import save_carmen
from mapping.io.map_file import load_map, save_map
from mapquilt.cli.app import VERBS, run
from tests.mapquilt.cli.test_app import office_map
from tests.mapquilt.dataset.conftest import SPEC
from tests.mapquilt.logs.bags import room_bag
from tests.mapquilt.logs.rooms import room_log

README = Path(__file__).parents[1] / "README.md"


def test_the_python_example_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for name in ("floor_a", "floor_b"):
        save_map(office_map(), tmp_path / name)
    example = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.DOTALL)[0]
    exec(compile(example, "README.md", "exec"), {})
    assert capsys.readouterr().out.startswith("True ")
    assert load_map("merged.yaml").grid.occupied.any()


SHORTER = {
    "simulate": "--robots 2 --duration 12",
    "study": "--missions 1 --method orb --set robots=2 --set duration=4 --set starts=close",
}
"""Options that are added to a verb, so that it takes seconds."""

OTHERS = """\
mapquilt sense runs/office-3-6 --noise 2 --out runs/noisy
mapquilt worlds list
mapquilt worlds show office --seed 1 --out office.png
mapquilt worlds make office --seed 1 --out office.json
mapquilt lidars
mapquilt report bench
mapquilt report data
mapquilt convert floor_a.yaml copy.png"""
"""Commands of the verbs that the README does not show."""


def commands():
    shown = re.findall(r"^    (mapquilt .*)$", README.read_text(), re.MULTILINE)
    split = [shlex.split(line, comments=True)[1:] for line in (*shown, *OTHERS.splitlines())]
    return [words for words in split if words[0] != "align"]


def test_the_commands_below_use_every_verb():
    """``calibrate`` needs more pairs than a test can make: tests/mapquilt/benchmark/test_fitting.py runs it. ``align``
    serves until it is ended: tests/mapquilt/align runs it."""
    assert {*(words[0] for words in commands()), "calibrate", "align"} == VERBS.keys()


@pytest.fixture
def files(tmp_path, monkeypatch):
    """The files that the commands of the README read."""
    monkeypatch.chdir(tmp_path)
    for name in ("floor_a", "floor_b"):
        save_map(office_map(), tmp_path / name)
    for seed, name in enumerate(("ground.png", "upper.png"), start=1):
        run(["worlds", "draft", "house", "--seed", str(seed), "--out", name])
    recorded = room_log()
    for number, name in enumerate(("floor.bag", "a.bag", "b.mcap")):
        made = room_bag(Path(name).suffix[1:], recorded).write(_folder(tmp_path / f"bag_{number}"))
        made.rename(name)
    save_carmen(tmp_path / "floor.log", recorded.log, recorded.reference)
    Path("floor.log.gz").write_bytes(gzip.compress(Path("floor.log").read_bytes()))
    return tmp_path


def _folder(path):
    path.mkdir()
    return path


@pytest.mark.slow
def test_every_command_runs_to_its_end(files, capsys):
    """Verdicts of a merge may differ on such short missions; nothing else may."""
    for words in commands():
        status = run([*words, *shlex.split(SHORTER.get(words[0], ""))])
        assert status in ((0, 1) if words[0] in ("merge", "live", "locate") else (0,)), (words, capsys.readouterr().err)
        for option, value in itertools.pairwise(words):
            assert option != "--out" or Path(value).exists(), words
        if words[:2] == ["dataset", "init"]:
            Path(words[2]).write_text(SPEC)


def test_every_link_points_to_a_file():
    for target in re.findall(r"\]\(([^)#:]+)\)", README.read_text()):
        assert (README.parent / target).exists(), target
