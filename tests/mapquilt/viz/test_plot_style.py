"""Curves that coincide can be told apart, and counts have whole ticks."""

from __future__ import annotations

import pytest

from mapquilt.dataset.card import draw_figures
from mapquilt.report.charts import common_charts
from mapquilt.viz.plot_style import draw_series, new_figure, whole_numbers
from tests.mapquilt.evaluation.examples import GOOD, evaluated

READABLE = 8.4
"""Width [inches] of a figure whose letters are read in a window of 800 pixels."""


def test_the_first_series_lies_on_top_and_series_differ_by_more_than_colour() -> None:
    _, (panel,) = new_figure(1)
    lines = [draw_series(panel, [(0.0, 1.0, None), (1.0, 1.0, None)], index) for index in range(3)]
    heights = [line.get_zorder() for line in lines]
    assert heights == sorted(heights, reverse=True)
    assert len(set(heights)) == 3
    for differ in (line.get_linestyle() for line in lines), (line.get_marker() for line in lines):
        assert len(set(differ)) == 3


@pytest.mark.parametrize("most", [1, 2, 7, 1000])
def test_counts_have_whole_ticks(most: int) -> None:
    _, (panel,) = new_figure(1)
    panel.bar([0], [most])
    whole_numbers(panel, "y")
    assert all(tick == int(tick) for tick in panel.get_yticks())


def test_the_histograms_of_a_small_data_set_count_in_whole_numbers() -> None:
    pair = {"overlap": 0.5, "target_from_source": {"scale": 1.0}, "residual_m": 0.01}
    figure = draw_figures([{"pairs": [pair], "maps": [{"distortion_m": 0.01}]}])
    for panel in figure.axes:
        assert all(tick == int(tick) for tick in panel.get_yticks())
    assert {panel.get_title(loc="left") for panel in figure.axes} == {"1 pair", "1 map"}


def test_charts_are_read_in_a_narrow_window() -> None:
    answers = tuple(
        evaluated(True, GOOD, method=method, name=str(k), noise=float(k % 2), overlap=0.2 + 0.05 * k)
        for method in ("quilt", "orb", "sift")
        for k in range(12)
    )
    charts = common_charts(answers, of_study=False)
    assert {chart.heading for chart in charts} >= {"Outcomes", "Errors, with refusals", "Calibration"}
    assert max(chart.figure.get_figwidth() for chart in charts) <= READABLE
