"""Reports show the content of their folder, in one self-contained file."""

from __future__ import annotations

import csv
import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from mapquilt.benchmark.files import PAIRS_FILE
from mapquilt.cli.verbs.report import read_content
from mapquilt.report.charts import common_charts
from mapquilt.report.gallery import choose
from mapquilt.report.page import render_page
from mapquilt.report.summary import headline
from tests.conftest import command
from tests.mapquilt.evaluation.examples import BAD, GOOD, evaluated

VOID = {"meta", "link", "img", "input", "br"}


class Page(HTMLParser):
    """Checks that tags close in order, and gathers what the tests look at."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.addresses: list[str] = []
        self.images: list[dict[str, str | None]] = []
        self.rows: list[dict[str, str | None]] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        fields = dict(attrs)
        if tag not in VOID:
            self.open.append(tag)
        self.ids += [fields["id"]] if "id" in fields else []
        self.addresses += [fields[name] for name in ("src", "href", "xlink:href") if fields.get(name)]
        if tag == "img" or fields.get("role") == "img":
            self.images.append(fields)
        if tag == "tr" and "data-number" in fields:
            self.rows.append(fields)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def page_of(folder: Path, pictures: int = 4) -> tuple[Page, str]:
    text = render_page(read_content(folder), pictures)
    return Page(text), text


def embedded(text: str, name: str):
    return json.loads(re.search(rf'<script type="application/json" id="{name}">(.*?)</script>', text, re.DOTALL)[1])


@pytest.fixture(params=["merged_run", "tiny", "tiny_benchmark", "tiny_study"])
def folder(request: pytest.FixtureRequest) -> Path:
    return request.getfixturevalue(request.param)


def test_the_page_needs_no_other_file(folder):
    page, text = page_of(folder)
    assert page.open == []
    assert len(page.ids) == len(set(page.ids))
    assert all(address.startswith(("data:", "#")) for address in page.addresses)
    assert not re.search(r"(?:src|href|url\()\s*=?\s*[\"']?https?:", text)
    assert "Content-Security-Policy" in text
    for image in page.images:
        if "thumb" not in (image.get("class") or "") and image.get("src"):
            assert image.get("alt") or image.get("aria-label")
    assert all(image["aria-label"] for image in page.images if image.get("role") == "img")
    shown, images = embedded(text, "shown"), embedded(text, "images")
    assert 0 < len(shown) <= 4
    assert {place for one in shown.values() for place in one.values() if place is not None} == set(range(len(images)))
    assert len(images) == len(set(images))


def test_a_run_shows_its_score(merged_run):
    page, text = page_of(merged_run)
    score = json.loads((merged_run / "score.json").read_text())
    assert [row["data-outcome"] for row in page.rows] == [pair["outcome"] for pair in score["pairs"]]
    assert text.count("data:image/png;base64,") >= 2 + len(embedded(text, "images"))


def test_a_run_without_score_or_merge_says_so(fresh_run):
    scored = [one.outcome for one in read_content(fresh_run).answers]
    (fresh_run / "score.json").unlink()
    assert [one.outcome for one in read_content(fresh_run).answers] == scored
    for name in ("merge.json", "merged.yaml", "merged.pgm", "merge.png", "overview.png"):
        (fresh_run / name).unlink()
    content = read_content(fresh_run)
    assert {one.outcome for one in content.answers} == {None}
    assert "None is merged yet" in headline(content)
    assert Page(render_page(content, 1)).open == []


def test_a_benchmark_shows_each_row_of_its_table(tiny_benchmark):
    rows = list(csv.DictReader((tiny_benchmark / PAIRS_FILE).open()))
    answers = read_content(tiny_benchmark).answers
    assert [(one.method, one.accepted, one.confidence) for one in answers] == [
        (row["method"], row["accepted"] == "True", float(row["confidence"])) for row in rows
    ]
    assert all(one.pair.target_file.is_file() and one.pair.source_file.is_file() for one in answers)
    assert all(one.seconds is not None and one.seconds > 0.0 for one in answers)
    assert [one.outcome for one in answers] == [row["outcome"] for row in rows]
    assert any(one.negative for one in answers)


def test_a_study_shows_each_trial_and_each_test(tiny_study):
    page, text = page_of(tiny_study)
    assert [row["data-level"] for row in page.rows] == ["0", "0", "3", "3"] * 2
    assert "Is one method better?" in text
    assert "not shown to differ from" in text


def test_a_data_set_shows_pairs_that_are_not_merged(tiny):
    content = read_content(tiny)
    assert {one.outcome for one in content.answers} == {None}
    assert sum(one.negative for one in content.answers) >= 2


def test_names_are_escaped(fresh_run):
    evil = "</script><script>alert(1)</script>"
    for name in ("run.json", "maps.json", "truth.json", "merge.json"):
        path = fresh_run / name
        record = json.loads(path.read_text())
        if name == "run.json":
            record["world"] = evil
        if name == "merge.json":
            for pair in record["pairs"]:
                pair["reason"] = evil
        path.write_text(json.dumps(record))
    (fresh_run / "score.json").unlink()
    text = render_page(read_content(fresh_run), 4)
    assert evil not in text
    assert Page(text).open == []


def test_errors_are_drawn_first_and_some_others_as_well():
    true, missed = evaluated(True, GOOD), evaluated(False, GOOD)
    answers = [true if k % 4 else missed for k in range(100)] + [evaluated(True, BAD)]
    chosen = choose(answers, 20)
    assert len(set(chosen)) == 20
    assert chosen[0] == 100
    assert {"false reject"} == {answers[k].outcome for k in chosen[1:10]}
    assert sum(answers[k].outcome == "true accept" for k in chosen) >= 5
    assert sorted(choose(answers, 500)) == list(range(101))


def test_the_command_writes_one_file_and_refuses_other_folders(tiny_study, tmp_path, capsys):
    copy = Path(shutil.copytree(tiny_study, tmp_path / "copy"))
    assert command("report", copy, "--pictures", 2) == 0
    assert "8 answers of the study copy" in capsys.readouterr().out
    assert (copy / "report.html").is_file()
    assert command("report", copy, "--pictures", 0, "--out", tmp_path / "r.html") == 0
    assert Page((tmp_path / "r.html").read_text()).open == []
    capsys.readouterr()
    (tmp_path / "empty").mkdir()
    assert command("report", tmp_path / "empty") == 2
    assert "is no run, finished data set, benchmark or study" in capsys.readouterr().err
    (copy / "maps" / "000" / "00" / "robot_0.yaml").unlink()
    assert command("report", copy, "--out", tmp_path / "lost.html") == 2
    assert "robot_0" in capsys.readouterr().err
    assert not (tmp_path / "lost.html").exists()


def test_curves_of_errors_end_at_the_share_that_was_accepted():
    """Three right answers and one refusal: the curves end at 75 %."""
    answers = (*(evaluated(True, GOOD, name=f"{k}") for k in range(3)), evaluated(False, GOOD, name="3"))
    (chart,) = [one for one in common_charts(answers, of_study=False) if one.heading.startswith("Errors")]
    for panel in chart.figure.axes:
        (line,) = panel.lines
        assert max(line.get_ydata()) == 0.75


def test_a_distorted_pair_says_by_how_much_and_not_why(merged_run):
    """A map drawn at true poses bends by noise alone, so that no cause is claimed."""
    content = read_content(merged_run)
    (one,) = content.answers
    bent = replace(one, distorted=True, truth=replace(one.truth, residual_m=0.314))
    text = render_page(replace(content, answers=(bent,)), 1)
    assert "the maps differ in shape: at the best transform, common walls lie 0.31 m apart (RMS)" in text
    assert "drift" not in text


def test_the_report_of_a_run_of_slam_shows_a_pose_graph_of_each_robot(merged_run):
    content = read_content(merged_run)
    graphs = [one for one in content.pictures if one.small]
    assert [one.heading for one in graphs] == ["robot_0", "robot_1"]
    assert all(re.match(r"\d+ keyframes and \d+ loops?\. ", one.caption) for one in graphs)
    assert {one.png[:4] for one in graphs} == {b"\x89PNG"}


def test_an_unmerged_data_set_shows_the_truth_of_its_pairs(tiny):
    content = read_content(tiny)
    (strata,) = content.sheets
    counted = {row[0]: int(row[1]) for row in strata.rows}
    assert counted["split: train"] + counted["split: test"] == sum(one.pair.suite != "" for one in content.answers)
    text = render_page(content, 0)
    heads = re.findall(r"<button type=\"button\">(.*?)</button>", text)
    assert {"overlap [%]", "one right answer", "residual [m]", "true scale"} <= set(heads)
    assert not {"outcome", "confidence"} & set(heads)
