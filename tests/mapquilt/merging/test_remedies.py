"""Refused pairs: what to try, and their picture."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from matplotlib.figure import Figure

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet, Unit
from mapquilt.cli.merge_notes import advice, files_note
from mapquilt.merging.remedies import ADVICE, mirrored_fit, remedy
from mapquilt.viz.merge_picture import merge_figure
from mapquilt.viz.refused_picture import refused_figure
from merge.merger import match_maps
from merge.records.pair_answer import Alternative
from merge.records.result import MergedGroup, MergeResult, PairResult
from merge.records.verdict import Reason, Refusal
from merge.settings import MergeSettings
from tests.mapquilt.cli.test_app import office_map

FREE = MergeSettings(scale=ScaleRange.free())
KNOWN = MergeSettings(scale=ScaleRange.known())


def maps(unit: Unit = "m", names: tuple[str, str] = ("a", "b")) -> MapSet:
    return MapSet(names, (office_map(), office_map(1)), (unit, unit))


def refused(reason: Reason, scale: float = 1.0, unit: Unit = "m", score: float | None = None) -> PairResult:
    place = Similarity2(0.0, 0.0, 0.0, scale)
    others = () if score is None else (Alternative(Similarity2(1.0), score),)
    return PairResult("a", "b", False, 0.3, Refusal(reason), place, None, unit, None, alternatives=others)


@pytest.mark.parametrize(
    ("pair", "settings", "says"),
    [
        (refused(Reason.LITTLE_OVERLAP, 1.02), FREE, "--scale known"),
        (refused(Reason.AMBIGUOUS, 0.97), FREE, "--scale known"),
        (refused(Reason.LITTLE_OVERLAP, 1.3), FREE, None),
        (refused(Reason.LITTLE_OVERLAP), KNOWN, "--scale free"),
        (refused(Reason.MIRRORED), FREE, None),
    ],
)
def test_a_scale_is_advised_where_it_may_help(pair: PairResult, settings: MergeSettings, says: str | None) -> None:
    text = remedy(pair, maps(), settings)
    assert ADVICE[pair.reason] in text
    assert ("--scale" in text) == (says is not None)
    assert says is None or says in text


def test_maps_in_cells_have_no_known_scale() -> None:
    assert "--scale" not in remedy(refused(Reason.LITTLE_OVERLAP, 1.0, "cell"), maps("cell"), FREE)


def result(*pairs: PairResult) -> MergeResult:
    grid = office_map()
    groups = tuple(MergedGroup(name, {name: Similarity2()}, grid, grid) for name in ("a", "b"))
    return MergeResult(("a", "b"), pairs, groups, {"b": "with a"})


def test_one_reason_is_not_told_again_and_several_by_the_names_of_the_table() -> None:
    one = refused(Reason.FREE_SPACE_VIOLATION, 1.3)
    assert advice(maps(), result(one), FREE, None) == (ADVICE[Reason.FREE_SPACE_VIOLATION],)
    two = dataclasses.replace(one, refusal=Refusal(Reason.LITTLE_OVERLAP))
    tips = advice(maps(), result(one, two), FREE, None)
    assert [tip.partition(": ")[0] for tip in tips] == ["if walls contradict free space", "if too little overlap"]


def test_files_name_the_map_that_stands_alone_and_count_the_copies(tmp_path) -> None:
    written = [tmp_path / name for name in ("merged.pgm", "inputs/2/b.yaml", "inputs/2/b.pgm")]
    note = " ".join(files_note(tmp_path, written, "r1").split())
    assert note.endswith("merged.pgm (r1 alone), inputs/ (a copy of 1 given map)")


def texts(figure: Figure) -> list[str]:
    return [text.get_text() for panel in figure.axes for text in (*panel.texts, panel.title, panel._left_title)]


@pytest.mark.parametrize(("unit", "label"), [("m", "m"), ("cell", "cells")])
def test_every_panel_has_the_unit_of_its_axes(unit: Unit, label: str) -> None:
    pair = refused(Reason.AMBIGUOUS, unit=unit)
    for figure in (
        merge_figure(maps(unit), result().groups),
        refused_figure(maps(unit), [pair], ["look"], [None]),
    ):
        assert len(figure.axes) > 1
        for panel in figure.axes:
            assert (panel.get_xlabel(), panel.get_ylabel()) == (f"x [{label}]", f"y [{label}]")


def test_the_picture_of_a_refusal_has_reason_and_remedy_and_the_better_place_first() -> None:
    figure = refused_figure(maps(), [refused(Reason.AMBIGUOUS, score=0.4)], ["look at the two placements"], [None])
    assert "Refused: two answers equally good\nTry: look at the two placements" in texts(figure)
    titles = [panel.get_title(loc="left") for panel in figure.axes]
    assert titles == ["elsewhere, score 0.40", "candidate"]


def test_a_map_alone_has_its_name_and_is_merged_with_none() -> None:
    figure = merge_figure(maps(), result().groups)
    assert "a alone" in texts(figure)
    assert any(text.startswith("none of 2 maps merged, frame of a") for text in texts(figure))
    assert texts(figure).count("not merged") == 2


def test_the_mirrored_fit_lays_walls_on_walls() -> None:
    grid = office_map()
    pair = MapSet(("a", "b"), (grid, OccupancyGrid(grid.frame, grid.log_odds[:, ::-1])), ("m", "m"))
    (answer,) = match_maps(pair, MergeSettings(), 0)
    assert answer.reason is Reason.MIRRORED
    fit = mirrored_fit(answer, pair, MergeSettings(), 0)
    assert fit is not None
    mirrored, found = fit
    assert found.accepted
    walls = mirrored.frame.metres_from_cells(np.argwhere(mirrored.occupied))
    cells = np.rint(grid.frame.cells_from_metres(found.target_from_source.apply(walls))).astype(int)
    assert grid.occupied[tuple(cells[grid.frame.contains(cells)].T)].mean() > 0.9
    figure = refused_figure(pair, [answer], ["flip"], [fit])
    assert figure.axes[0].get_title(loc="left").startswith("b mirrored, score ")
