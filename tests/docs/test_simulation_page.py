"""Check docs/simulation.md against the code, and run its examples."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from mapquilt.cli.options.robots_file import FIELDS
from sim.mission.running import PHYSICS_STEP
from sim.mission.settings import POLICIES, STARTS, MissionSettings
from sim.navigation.right_of_way import waiting_time
from sim.physics import bodies, bullet
from sim.physics.drive import DRIVES, DriveLimits
from sim.physics.robot import RobotSettings
from tests.conftest import command

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "simulation.md").read_text(encoding="utf-8")
TEXT = " ".join(PAGE.split())
BLOCKS = [re.sub(r"^    ", "", each, flags=re.MULTILINE) for each in re.findall(r"(?:^    .*\n)+", PAGE, re.MULTILINE)]
FILES = {name: block for block in BLOCKS for name in re.findall(r"\A# ([\w.]+)", block)}
COMMANDS = [shlex.split(line) for line in re.findall(r"^    mapquilt (.*)$", PAGE, re.MULTILINE)]
ROWS = [
    [cell.strip().strip("`") for cell in line.strip("|").split("|")]
    for line in re.findall(r"^\|.*$", PAGE, re.MULTILINE)
]
BEHAVIOUR = MissionSettings().behaviour
NAVIGATION = BEHAVIOUR.navigation
WAY = NAVIGATION.right_of_way
ELSEWHERE = {"--help", "--width", "--height", "--plan-resolution", "--level", "--from-map"}
"""Options of `simulate` that docs/worlds.md documents."""


def options(verb: str, capsys: pytest.CaptureFixture[str]) -> set[str]:
    assert command(verb, "--help") == 0
    return set(re.findall(r"^  (--[a-z-]+)", capsys.readouterr().out, re.MULTILINE))


def test_every_command_of_the_page_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        Path(name).write_text(text, encoding="utf-8")
    for words in COMMANDS:
        seconds = 20 if "--overlap" in words else 2
        short = ("--duration", seconds) if words[0] == "simulate" else ()
        assert command(*words, *short) == 0, words
    assert sorted(FILES) == ["patrol.tum", "team.yaml"]
    assert {words[0] for words in COMMANDS} == {"simulate", "sense"}


def test_its_picture_is_drawn_of_any_run(merged_run: Path, tmp_path: Path) -> None:
    script = [sys.executable, str(DOCS / "simulation_example.py"), str(merged_run), str(tmp_path / "seen.png")]
    subprocess.run(script, check=True, cwd=DOCS.parent)
    assert (tmp_path / "seen.png").read_bytes().startswith(b"\x89PNG")


def test_its_options_are_those_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    known = options("simulate", capsys)
    documented = set(re.findall(r"(?<![\w-])(--[a-z][a-z-]*)", PAGE))
    assert known - documented == ELSEWHERE
    assert documented <= known | options("sense", capsys)


def test_its_tables_have_every_field_and_every_choice() -> None:
    names = [row[0] for row in ROWS]
    assert all(names.count(name) == 1 for name in (*FIELDS, *STARTS, *DRIVES))
    assert all(f"**`--policy {name}`**" in PAGE for name in POLICIES)


@pytest.mark.parametrize("name", ["speed", "turn_rate", "acceleration", "turn_acceleration", "radius"])
def test_its_defaults_are_the_robots(name: str) -> None:
    (row,) = (row for row in ROWS if row[0] == name)
    robot = RobotSettings()
    assert float(row[3]) == (robot.radius if name == "radius" else getattr(DriveLimits(), name))


def test_its_waiting_times_are_those_of_the_rule() -> None:
    rooms = {
        "more room than the other robot": (1.0, 0.5),
        "equal room, within 0.1 m": (0.6, 0.5),
        "less room, for example in a door": (0.4, 0.6),
    }
    assert {row[0]: row[1] for row in ROWS if row[0] in rooms} == {
        who: f"{waiting_time(*each, 0):g} s" for who, each in rooms.items()
    }


@pytest.mark.parametrize(
    "documented",
    [
        f"1 to {bullet.MAX_ROBOTS}",
        f"({MissionSettings().duration:g} s)",
        f"lidars look at {bodies.RAY_HEIGHT:g} m above the ground, walls are {bullet.WALL_HEIGHT:g} m high",
        f"| {1000 * PHYSICS_STEP['velocity']:g} ms |",
        f"| 1/{1 / PHYSICS_STEP['wheels']:g} s |",
        f"friction {bodies.WHEEL_FRICTION:g}, a radius of {bodies.WHEEL_RADIUS:g} robot radii and a track of "
        f"{bodies.WHEEL_TRACK:g}; the body weighs {bodies.MASS:g} kg, and each motor pushes with at most "
        f"{bodies.MOTOR_FORCE:g} N",
        f"counts {BEHAVIOUR.exploration.persistence:g} times",
        f"no viewpoint for {BEHAVIOUR.exploration.patience:g} s",
        f"draws {BEHAVIOUR.patrol.goal_count} of its own",
        f"nearer than {NAVIGATION.routes.wall_distance:g} m to a wall",
        f"anew every {NAVIGATION.replan_time:g} s",
        f"over {NAVIGATION.steering.horizon:g} s",
        f"nearer than {NAVIGATION.steering.hull_margin:g} m to anything",
        f"moved less than {NAVIGATION.stuck.distance:g} m and turned less than {NAVIGATION.stuck.turn:g} rad in "
        f"{NAVIGATION.stuck.time:g} s",
        f"without that goal for {NAVIGATION.stuck.ban_time:g} s",
        f"nearer than {WAY.near:g} m and within {WAY.path_width:g} m of the path",
        f"up to {WAY.max_retreat:g} m",
        f"for {WAY.yield_time[0]:g} to {WAY.yield_time[1]:g} s, until no robot is within {WAY.clear_distance:g} m",
    ],
)
def test_its_numbers_are_those_of_the_code(documented: str) -> None:
    assert documented in TEXT
