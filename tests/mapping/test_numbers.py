"""Parsing of numbers and ranges."""

from __future__ import annotations

import pytest

from mapping.numbers import parse_number, parse_range


@pytest.mark.parametrize("text", ["0", "-1", "+2.50", ".5", "5.", "1e-3", "1E+6"])
def test_a_number_is_what_python_reads(text: str) -> None:
    assert parse_number(text) == float(text)


@pytest.mark.parametrize("text", ["", " 1", "1_0", "nan", "inf", "-inf", "1e999", "1,5", "0x10", "\u0661", "1:2", "."])
def test_exotic_python_numbers_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is no number"):
        parse_number(text)


def test_a_range_is_two_numbers() -> None:
    assert parse_range("0.5:2") == (0.5, 2.0)
    for text in ("1", "1:", ":2", "1:2:3", "1_0:2_0"):
        with pytest.raises(ValueError, match="is no number"):
            parse_range(text)
