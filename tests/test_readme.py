"""The commands and the Python example of the README work."""

import re
import shlex
from pathlib import Path

import pytest

from mapping.io.map_file import load_map, save_map
from mapquilt.cli.app import run
from tests.mapquilt.cli.test_app import office_map

README = Path(__file__).parents[1] / "README.md"


def test_the_python_example_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for name in ("floor_a", "floor_b"):
        save_map(office_map(), tmp_path / name)
    example = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.DOTALL)[0]
    exec(compile(example, "README.md", "exec"), {})
    assert capsys.readouterr().out.startswith("True ")
    assert load_map("merged.yaml").grid.occupied.any()


@pytest.mark.parametrize(
    "line",
    [line.split("#")[0].strip() for line in re.findall(r"^    (mapquilt .*)$", README.read_text(), re.MULTILINE)],
)
def test_every_command_has_a_help_that_knows_its_options(line, capsys):
    words = shlex.split(line)
    verbs = words[1:3] if words[1] in ("dataset", "worlds") else words[1:2]
    assert run([*verbs, "--help"]) == 0
    text = capsys.readouterr().out
    assert all(word in text for word in words if word.startswith("--"))


def test_every_link_points_to_a_file():
    for target in re.findall(r"\]\(([^)#:]+)\)", README.read_text()):
        assert (README.parent / target).exists(), target
