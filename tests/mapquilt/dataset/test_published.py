"""Published data sets: their digests, and the comparison of a data set with them."""

from __future__ import annotations

import copy
import hashlib
import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from benchmarks import published as publishing
from mapquilt.dataset import published
from mapquilt.dataset.carried_plans import carry_plans
from mapquilt.dataset.plan import plan_dataset
from mapquilt.dataset.spec import READY, load_spec
from tests.conftest import command
from tests.mapquilt.cli.test_app import refused
from tests.mapquilt.dataset.test_verify import reseal

CITED = ("smoke", "standard", "hard", "teams")


@pytest.fixture
def known(tiny: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """The published records, of which the tiny data set is one; to be changed."""
    records = {"tiny": copy.deepcopy(published.published_record(tiny))}
    monkeypatch.setattr(published, "published_records", lambda: records)
    return records


def test_the_same_data_by_another_version_of_the_code_is_equal(
    tiny: Path, known: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = shutil.copytree(tiny, tmp_path / "other")
    lines = (other / "manifest.jsonl").read_text().splitlines()
    header = json.loads(lines[0]) | {"generator": "mapquilt 9.9", "code": "9.9+0123456789ab"}
    (other / "manifest.jsonl").write_text("\n".join([json.dumps(header), *lines[1:]]) + "\n")
    reseal(other)
    assert command("dataset", "verify", other, "--published") == 0
    assert f"equals the published data set of {known['tiny']['generator']}, bit for bit" in capsys.readouterr().out


def test_records_that_differ_are_named_missions_first(
    tiny: Path, known: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    records = known["tiny"]["records"]
    records["samples/000003"] = records["missions/00001"] = "0" * published.DIGITS
    assert command("dataset", "verify", tiny, "--published") == 1
    out = capsys.readouterr().out
    first, second = (out.index(f"{name}: differs") for name in ("missions/00001", "samples/000003"))
    assert first < second < out.index("2 records unlike the published data set")
    del records["samples/000003"]
    records["samples/000009"] = "0" * published.DIGITS
    assert command("dataset", "verify", tiny, "--published") == 1
    out = capsys.readouterr().out
    assert "samples/000003: is not in the published data set" in out
    assert "samples/000009: is missing" in out


def test_another_header_or_negative_pair_is_a_difference(
    tiny: Path, known: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    known["tiny"]["digest"] = "0" * 64
    assert command("dataset", "verify", tiny, "--published") == 1
    assert "manifest.jsonl: its header, plans or pairs of two worlds" in capsys.readouterr().out


def test_an_unknown_data_set_and_another_specification_are_refused(
    tiny: Path, known: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    known["tiny"]["spec"] = "0" * 64
    assert "is another specification than that of the published data set 'tiny'" in refused(
        capsys, "dataset", "verify", tiny, "--published"
    )
    known["tinny"] = known.pop("tiny")
    assert "no data set 'tiny' is published, only tinny" in refused(capsys, "dataset", "verify", tiny, "--published")


def test_a_data_set_is_published_beside_the_others(tiny: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    others = published.published_records()
    monkeypatch.setattr(published, "__file__", str(tmp_path / "published.py"))
    assert publishing.main([str(tiny)]) == 0
    written = json.loads((tmp_path / published.PUBLISHED_FILE).read_text())
    assert written == {**others, "tiny": published.published_record(tiny)}


@pytest.mark.parametrize("name", published.published_records())
def test_a_published_data_set_is_of_the_present_specification(name: str) -> None:
    assert name in READY
    text = carry_plans(load_spec(name)).spec.model_dump_json(indent=2) + "\n"
    assert published.published_records()[name]["spec"] == hashlib.sha256(text.encode()).hexdigest()


@pytest.mark.slow
def test_no_world_is_in_two_data_sets_to_cite() -> None:
    places: dict[str, str] = {}
    for name in CITED:
        carried = carry_plans(load_spec(name))
        for mission in plan_dataset(carried.spec, carried.worlds).missions:
            assert places.setdefault(mission.fingerprint, name) == name
