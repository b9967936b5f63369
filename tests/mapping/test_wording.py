"""Wording of counts, times, numbers and suggestions."""

from __future__ import annotations

import pytest

from mapping.wording import counted, did_you_mean, duration, fixed, merged_count


@pytest.mark.parametrize(("number", "text"), [(0, "0 pairs"), (1, "1 pair"), (2, "2 pairs")])
def test_one_is_singular(number: int, text: str) -> None:
    assert counted(number, "pair") == text


def test_an_irregular_plural_is_given() -> None:
    assert [counted(n, "pair of maps", "pairs of maps") for n in (1, 2)] == ["1 pair of maps", "2 pairs of maps"]


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.42, "0.42 s"), (29.9, "30 s"), (100.0, "100 s"), (720.0, "12 min"), (12600.0, "3.5 h"), (3.6e6, "1,000 h")],
)
def test_a_time_has_the_unit_that_suits_it(seconds: float, text: str) -> None:
    assert duration(seconds) == text


@pytest.mark.parametrize(("value", "text"), [(-1e-9, "0.000"), (-0.0, "0.000"), (-0.0006, "-0.001"), (1.5, "1.500")])
def test_a_zero_has_no_minus(value: float, text: str) -> None:
    assert fixed(value, 3) == text


def test_a_map_alone_is_merged_with_none() -> None:
    assert [merged_count(n, 3) for n in (1, 2, 3)] == [f"{n} of 3 maps merged" for n in ("none", "2", "3")]


def test_the_nearest_name_is_asked_for_if_one_is_near() -> None:
    assert did_you_mean("offce", ["house", "office"]) == "; did you mean office?"
    assert did_you_mean("xyz", ["house", "office"]) == ""
