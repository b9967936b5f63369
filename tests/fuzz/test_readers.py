"""Fuzz the readers: our own files, damaged, are read or refused by one line that names the file.

``FUZZ_CASES`` sets the number of cases of each reader; ``make fuzz`` draws new ones each time.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.io.carmen_reader import load_carmen
from mapping.io.map_file import load_map
from mapping.io.picture import Picture, picture_bytes, read_picture
from mapping.io.relations_file import load_relations
from mapping.io.robot_log_file import load_robot_log, save_robot_log
from mapping.io.safe_load import read_json, read_json_lines, read_yaml
from mapping.io.tum import load_tum, save_tum
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory
from mapquilt.benchmark.pair_sets import read_pair_list
from mapquilt.dataset.manifest import read_manifest
from mapquilt.dataset.spec import load_spec, ready_spec
from mapquilt.runs.open_world import open_world
from tests.conftest import command
from worlds.families.registry import make_world
from worlds.world_file import world_to_json

CASES = int(os.environ.get("FUZZ_CASES", "40"))
FUZZ = settings(max_examples=CASES, derandomize="FUZZ_CASES" not in os.environ, suppress_health_check=list(HealthCheck))
HOSTILE: tuple[Any, ...] = (
    *(None, True, -1, 0, 0.5, 1e15, -1e15, 2**63, 2**127, "", "../x", "/etc/passwd", "\x1b[31m", "x" * 10_000),
    *([], {}, [[]], {"": None}, [0] * 1000),
)


def trajectory() -> Trajectory:
    return Trajectory(np.arange(4.0), np.column_stack((np.arange(4.0), np.zeros(4), np.linspace(0.0, 1.0, 4))))


def log(folder: Path) -> bytes:
    scans = tuple(LidarScan(float(k), -1.0, 0.5, 0.1, 9.0, np.full(4, 2.0, np.float32)) for k in range(4))
    save_robot_log(folder / "log.npz", RobotLog(scans, trajectory(), SE2(0.1), "robot_0"))
    return (folder / "log.npz").read_bytes()


def tum(folder: Path) -> bytes:
    save_tum(folder / "path.tum", trajectory())
    return (folder / "path.tum").read_bytes()


def picture(kind: str) -> bytes:
    grey = np.random.default_rng(1).integers(0, 255, (9, 7)).astype(np.uint8)
    return picture_bytes(Picture(grey), kind)


def world(folder: Path) -> bytes:
    return json.dumps(world_to_json(make_world("house", 1))).encode()


def manifest(folder: Path) -> bytes:
    (folder / "spec.yaml").write_text(SPEC)
    assert command("dataset", "make", folder / "spec.yaml", "--out", folder / "data", "--workers", 1) == 0
    return (folder / "data/manifest.jsonl").read_bytes()


CARMEN = b"".join(b"FLASER 4 1.0 2.0 3.0 4.0 0.%d 0 0 0.%d 0 0 %d.5 host %d.5\n" % (k, k, k, k) for k in range(1, 6))
PAIR = {"name": "p", "kind": "x", "map_a": "map.pgm", "map_b": "map.pgm", "scale": 1, "rotation_deg": 0}
PAIRS = json.dumps({"pairs": [PAIR | {"tx": 0, "ty": 0}]}).encode()
MAP_YAML = b"image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
SPEC = """
name: fuzz
seed: 1
missions: [{world: house, count: 2, robots: 2, duration: 3}]
samples: {per_mission: 1, poses: [odometry]}
other_worlds: 1
splits: {test: 1.0}
"""
SMOKE = ready_spec("smoke").encode()

READERS: dict[str, tuple[str, Callable[[Path], bytes], Callable[[Path], object]]] = {
    "npz": ("log.npz", log, load_robot_log),
    "tum": ("path.tum", tum, load_tum),
    "relations": ("x.relations", lambda _: b"0 1 1 0 0 0 0 0.5\n", load_relations),
    "carmen": ("x.log", lambda _: CARMEN, load_carmen),
    "pgm": ("map.pgm", lambda _: picture("pgm"), read_picture),
    "png": ("map.png", lambda _: picture("png"), read_picture),
    "map": ("map.yaml", lambda _: MAP_YAML, load_map),
    "json": ("x.json", world, read_json),
    "jsonl": ("x.jsonl", manifest, read_json_lines),
    "yaml": ("x.yaml", lambda _: SMOKE, read_yaml),
    "world": ("world.json", world, lambda path: open_world(str(path), 1)),
    "pairs": ("pairs.json", lambda _: PAIRS, read_pair_list),
    "manifest": ("manifest.jsonl", manifest, lambda path: read_manifest(path.parent)),
    "spec": ("spec.yaml", lambda _: SMOKE, lambda path: load_spec(str(path))),
}
"""File name, the content by our own writer, and the reader."""


@cache
def content(reader: str) -> bytes:
    """Return a file of the reader's kind, as our own writer makes it."""
    with tempfile.TemporaryDirectory() as folder:
        return READERS[reader][1](Path(folder))


EDIT = st.tuples(st.integers(0, 10**6), st.sampled_from(("set", "cut", "drop", "copy")), st.integers(0, 255))


def damaged(data: bytes, edits: list[tuple[int, str, int]]) -> bytes:
    """Change bytes, truncate, remove a piece, or copy one to another place."""
    for at, kind, value in edits:
        at = at % max(len(data), 1)
        if kind == "set":
            data = data[:at] + bytes([value]) + data[at + 1 :]
        elif kind == "cut":
            data = data[:at] if value < 32 else data
        elif kind == "drop":
            data = data[:at] + data[at + value :]
        else:
            data = data[:at] + data[at // 2 : at // 2 + value] + data[at:]
    return data


def refusal(reader: str, data: bytes) -> str | None:
    """Read the bytes; return the line by which they are refused, with the folder cut off, None if they are read."""
    name, _, read = READERS[reader]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "map.pgm").write_bytes(picture("pgm"))
        path = Path(folder) / name
        path.write_bytes(data)
        try:
            read(path)
        except (ValueError, OSError) as error:
            return str(error).replace(f"{folder}/", "FOLDER/")
    return None


def is_one_line(line: str | None) -> bool:
    """Return whether there is no refusal, or one line that names a file of the folder."""
    return line is None or ("FOLDER/" in line and "\n" not in line)


@pytest.mark.parametrize("reader", READERS)
def test_the_undamaged_file_is_read(reader: str) -> None:
    assert refusal(reader, content(reader)) is None


@pytest.mark.parametrize("reader", READERS)
@FUZZ
@given(edits=st.lists(EDIT, min_size=1, max_size=5))
def test_damaged_bytes_are_read_or_refused(reader: str, edits: list[tuple[int, str, int]]) -> None:
    assert is_one_line(refusal(reader, damaged(content(reader), edits)))


def leaves(value: Any) -> list[tuple[Any, Any]]:
    """List every container of a JSON value with each of its keys."""
    if isinstance(value, list | dict):
        keys = list(value) if isinstance(value, dict) else list(range(min(len(value), 5)))
        return [(value, key) for key in keys] + [found for key in keys for found in leaves(value[key])]
    return []


@pytest.mark.parametrize("reader", ["world", "pairs", "manifest"])
@FUZZ
@given(at=st.integers(0, 10**6), value=st.sampled_from(HOSTILE))
def test_hostile_values_are_read_or_refused(reader: str, at: int, value: Any) -> None:
    record = [json.loads(line) for line in content(reader).splitlines()]
    places = leaves(record)[len(record) :]
    holder, key = places[at % len(places)]
    holder[key] = value
    assert is_one_line(refusal(reader, b"\n".join(json.dumps(line).encode() for line in record)))
