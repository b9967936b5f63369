"""Tables of 80 columns: names are folded behind their separators, numbers never."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapquilt.cli.tables import print_table
from mapquilt.dataset.listing import pair_table
from mapquilt.viz.text_table import folded, plain_table

TEXTS = st.text(alphabet="ab_/.- ", max_size=60)


@given(TEXTS, st.integers(3, 30))
def test_folding_keeps_every_letter_within_the_width_if_its_parts_fit(text: str, width: int) -> None:
    lines = folded(text, width)
    assert "".join("".join(lines).split()) == "".join(text.split())
    parts = text.replace(" ", "_").replace("/", "_").replace(".", "_").replace("-", "_").split("_")
    if "__" not in text.translate(str.maketrans("/.- ", "____")) and max(map(len, parts)) < width:
        assert max(map(len, lines)) <= width


@pytest.mark.parametrize(
    ("width", "lines"),
    [
        (40, ["floor <- log_acapulco_high_a"]),
        (22, ["floor", "<- log_acapulco_high_a"]),
        (16, ["floor", "<- log_acapulco_", "high_a"]),
    ],
)
def test_names_are_folded_behind_separators(width: int, lines: list[str]) -> None:
    assert folded("floor <- log_acapulco_high_a", width) == lines


def test_a_table_too_wide_folds_names_and_keeps_numbers_and_headers_whole(capsys: pytest.CaptureFixture[str]) -> None:
    table = plain_table(("pair", False), ("verdict", False), ("x, y", True), ("identifiable", False))
    table.add_row("a_long_name_of_a_map <- log_acapulco_high_a", "accepted", "-1234.56, 9876.54 cells", "yes")
    print_table(table)
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 80
    for whole in ("-1234.56, 9876.54 cells", "identifiable", "accepted", "acapulco_"):
        assert whole in printed


def test_a_table_of_many_long_names_still_fits(capsys: pytest.CaptureFixture[str]) -> None:
    sample = {"sample": "000001", "split": "validation", "world": "corridor_loop", "settings": {"noise": 0.25}}
    pair = {"target": "robot_10_part_12", "source": "robot_11_part_12"}
    pair |= {"overlap": 1.0, "residual_m": 0.123, "identifiable": True}
    print_table(pair_table(iter([(sample, pair)])))
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 80
    for whole in ("000001", "target", "validation", "corridor_", "loop", "0.25", "100 %", "0.123", "fit", "yes"):
        assert whole in printed
