"""The view of a live merge fits its terminal and shows every robot."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios
from dataclasses import replace
from itertools import combinations

import pytest
from rich.console import Console

from mapquilt.live.live_merger import LiveMerger, LiveState
from mapquilt.live.terminal_view import MergeRate, overview
from tests.mapquilt.live.test_live_merger import drive, sent


@pytest.fixture(scope="module")
def state() -> LiveState:
    """Two robots that are joined, and a third whose map is garbage."""
    merger = LiveMerger()
    drive(merger, range(8, 10), ("robot_0", "robot_2"))
    return merger.update([replace(sent("robot_1", 5), width=7)], 12.0)


def lines(state: LiveState, now: float | None = 20.0, height: int = 40, frozen: bool = False) -> list[str]:
    console = Console(width=80, height=height, color_system=None, markup=False)
    with console.capture() as capture:
        console.print(
            overview(state, now, "1.0 updates/s", frozen=frozen, settings=LiveMerger().settings, height=height)
        )
    return capture.get().splitlines()


def of_robots(shown: list[str]) -> dict[str, str]:
    return {line.split()[0]: line for line in shown if line.startswith(" robot_") and "<-" not in line}


def test_robots_and_pairs_are_shown_with_state_age_and_reason(state):
    shown = lines(state)
    rows = of_robots(shown)
    assert "joined" in rows["robot_0"]
    assert "alone" in rows["robot_1"]
    assert "8" in rows["robot_1"].split(), "its age"
    assert any("cells, must have" in line for line in shown) or any("data has" in line for line in shown)
    assert any("robot_0 <- robot_2" in line and "accepted" in line for line in shown)
    assert "2 of 3 robots joined" in shown[0]
    assert "age [s]" in "\n".join(shown)
    assert "frozen" not in shown[0]
    assert "frozen" in lines(state, frozen=True)[0]


def test_silence_is_shown_instead_of_the_reason(state):
    assert "silent" in of_robots(lines(state, now=100.0))["robot_0"]


def test_a_crowd_with_long_names_fits_80_columns_and_the_height(state):
    names = [f"warehouse_forklift_number_{k}" for k in range(20)]
    crowd = replace(
        state,
        robots=dict.fromkeys(names, state.robots["robot_0"]),
        placements=dict.fromkeys(names, state.placements["robot_0"]),
        pairs=dict.fromkeys(combinations(names, 2), state.pairs["robot_0", "robot_2"]),
    )
    shown = lines(crowd, height=60)
    assert max(map(len, shown)) <= 80
    assert "and 162 more pairs, matched before" in "\n".join(shown)
    assert "no map yet" in lines(LiveState(), None)[-1]


@pytest.mark.slow
def test_a_terminal_shows_the_view_and_the_table_at_the_end():
    """No robot is there: the view says so until the time is over."""
    pytest.importorskip("cyclonedds", reason="needs the extra [live]: pip install mapquilt[live]")
    terminal, end = pty.openpty()
    fcntl.ioctl(end, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 80, 0, 0))
    words = (sys.executable, "-m", "mapquilt", "live", "--topic", "/robot_0/map", "--duration", "2", "--domain", "101")
    environment = {**os.environ, "ROS_LOCALHOST_ONLY": "1", "TERM": "xterm"}
    process = subprocess.Popen(words, stdout=end, stderr=end, stdin=end, env=environment)
    os.close(end)
    shown = b""
    with contextlib.suppress(OSError):  # Linux's way to tell the end of a terminal
        while piece := os.read(terminal, 4096):
            shown += piece
    os.close(terminal)
    assert process.wait(timeout=60) == 1
    text = shown.decode()
    assert "no map yet" in text
    assert "0 of 0 robots joined; 0 updates" in text
    assert text.index("no map yet") < text.index("0 of 0 robots joined; 0 updates")


def test_the_rate_counts_recent_updates_only():
    rate = MergeRate(window=10.0)
    for k in range(20):
        rate.add(0.5 if k < 15 else 1.5, float(k))
    assert rate.text(20.0) == "1.0 updates/s, median 1.00 s, longest 1.50 s"
    assert rate.text(40.0) == "no update in the last 10 s"
