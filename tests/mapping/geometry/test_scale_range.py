import math

import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from merge.settings import MergeSettings


def test_parse_reads_all_three_forms():
    assert ScaleRange.parse("known") == ScaleRange(1.0, 1.0)
    assert ScaleRange.parse("free") == ScaleRange(0.5, 2.0)
    assert ScaleRange.parse("0.25:4") == ScaleRange(0.25, 4.0)


@pytest.mark.parametrize("text", ["2:0.5", "0:1", "-1:1", "nan:1", "1:inf", "wide", "1", "1:2:3", "", ":"])
def test_a_bad_range_is_refused_by_its_text(text):
    with pytest.raises(ValueError, match="scale is") as refusal:
        ScaleRange.parse(text)
    assert text in str(refusal.value)


def test_bad_bounds_are_refused_by_value():
    with pytest.raises(ValueError, match=r"low is 2\.0, must be at most high, 1\.0"):
        ScaleRange(2.0, 1.0)
    with pytest.raises(ValueError, match="high is nan"):
        ScaleRange(1.0, math.nan)


def test_the_inverse_range_holds_the_inverse_scales():
    assert ScaleRange(0.5, 4.0).inverse() == ScaleRange(0.25, 2.0)


def test_an_unknown_method_is_named():
    with pytest.raises(ValueError, match="'shift'"):
        MergeSettings(method="shift")


@pytest.mark.parametrize(
    ("units", "trusted", "expected"),
    [
        (("m", "m"), True, ScaleRange.known()),
        (("m", "m"), False, ScaleRange.free()),
        (("m", "cell"), True, ScaleRange.free()),
    ],
)
def test_the_scale_is_known_only_if_every_resolution_is(units, trusted, expected):
    grid = OccupancyGrid.from_occupancy(GridFrame(0.05, SE2(), (1, 1)), [[0]])
    assert MapSet(("a", "b"), (grid, grid), units, trusted).scale_range == expected
