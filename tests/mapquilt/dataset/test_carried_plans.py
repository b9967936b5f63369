"""A data set carries its plans: it can be made again where the plan is gone, and refuses a changed one."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mapquilt.dataset.manifest import read_manifest
from mapquilt.jobs.code_version import code_version
from tests.conftest import command
from tests.mapquilt.cli.test_app import refused

SPEC = """\
name: flats
missions:
  - {{world: {plan}, plan_resolution: 0.1, from_map: true, count: 1, robots: 1, duration: 1, licence: CC0-1.0}}
  - {{world: maze, count: 1, robots: 1, duration: 1}}
samples: {{per_mission: 1, poses: [truth]}}
splits: {{test: 1}}
"""


def draw(path: Path, divider: int = 60) -> Path:
    """Two rooms without a door; mending fills the smaller one."""
    cells = np.full((50, 90), 255, np.uint8)
    cells[[0, 1, -2, -1]] = cells[:, [0, 1, divider, divider + 1, -2, -1]] = 0
    Image.fromarray(cells).save(path)
    return path


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A data set with a plan, made in the folder of both, named by a relative path."""
    monkeypatch.chdir(tmp_path)
    draw(tmp_path / "flat.png")
    Path("spec.yaml").write_text(SPEC.format(plan="flat.png"), encoding="utf-8")
    assert command("dataset", "make", "spec.yaml", "--out", "data", "--workers", 1) == 0
    return tmp_path / "data"


def test_the_plan_is_copied_and_hashed_with_its_licence(made: Path) -> None:
    manifest = read_manifest(made)
    (plan,) = manifest.plans
    content = (made / plan["file"]).read_bytes()
    assert plan == {
        "kind": "plan",
        "file": "plans/flat.json",
        "name": "flat.png",
        "licence": "CC0-1.0",
        "sha256": hashlib.sha256(content).hexdigest(),
    }
    assert [(record["world"], record["licence"]) for record in manifest.missions] == [
        ("flat", "CC0-1.0"),
        ("maze", "CC-BY-4.0"),
    ]
    assert manifest.header["code"] == code_version()
    card = (made / "README.md").read_text(encoding="utf-8")
    assert "| `plans/flat.json`, from flat.png | CC0-1.0 |" in card
    assert "Licence of the data: CC-BY-4.0, CC0-1.0." in card
    assert str(made.parent) not in (made / "spec.json").read_text(encoding="utf-8")


def test_a_sample_and_the_whole_set_are_made_again_without_the_plan(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("flat.png").unlink()
    elsewhere = tmp_path / "elsewhere"
    shutil.move(made, elsewhere)
    assert command("dataset", "verify", elsewhere) == 0
    assert command("dataset", "remake", elsewhere, "000000", "--out", tmp_path / "again") == 0
    assert "bit for bit" in capsys.readouterr().out
    copy = tmp_path / "copy"
    assert command("dataset", "make", elsewhere / "spec.json", "--out", copy, "--workers", 1) == 0
    assert (copy / "manifest.jsonl").read_text().splitlines()[2:] == (
        elsewhere / "manifest.jsonl"
    ).read_text().splitlines()[2:]


def test_a_changed_plan_is_refused_and_named(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    draw(tmp_path / "flat.png", divider=70)
    capsys.readouterr()
    assert command("dataset", "make", "spec.yaml", "--out", made) == 2
    note, fault = capsys.readouterr().err.splitlines()
    assert "flat.png: filled closed gaps and 1 part of the floor" in note
    assert "other settings" in fault
    plan = made / "plans/flat.json"
    record = json.loads(plan.read_text(encoding="utf-8"))
    plan.write_text(json.dumps({**record, "seed": 3}), encoding="utf-8")
    assert command("dataset", "verify", made) == 1
    assert "plans/flat.json: has changed" in capsys.readouterr().out
    line = refused(capsys, "dataset", "remake", made, "000000", "--out", tmp_path / "again")
    assert "flat.json: has changed" in line


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("world: flat.png, count: 1", "flat.png: a plan that is a picture needs --plan-resolution"),
        ("world: flat.png, plan_resolution: 0.1, count: 1", "in 2 parts"),
        ("world: ofice, count: 1", "missions.1.world: is ofice, must be a file or one of office, "),
        ("world: gone.json, count: 1", "gone.json"),
    ],
)
def test_a_plan_that_cannot_be_explored_is_refused_before_the_first_mission(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], keys: str, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    draw(tmp_path / "flat.png")
    Path("spec.yaml").write_text(
        f"name: flats\nmissions:\n  - {{world: maze, count: 1}}\n  - {{{keys}}}\n", encoding="utf-8"
    )
    assert message in refused(capsys, "dataset", "make", "spec.yaml", "--out", "data")
    assert not Path("data").exists()
