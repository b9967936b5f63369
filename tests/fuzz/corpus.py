"""Files of every kind that is read, by our own writers or as small as the format allows, each with its reader."""

from __future__ import annotations

import gzip
import json
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from hashlib import sha256
from pathlib import Path

import numpy as np

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.io.carmen import save_carmen
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
from mapquilt.benchmark.exchange.answers import read_answers
from mapquilt.benchmark.files import load_answers, write_folder
from mapquilt.benchmark.pair_list import read_pair_list
from mapquilt.benchmark.results import build_results
from mapquilt.benchmark.trials import run_benchmark
from mapquilt.dataset.carried_plans import carry_plans
from mapquilt.dataset.make import is_whole
from mapquilt.dataset.manifest import read_manifest
from mapquilt.dataset.plan import MissionPlan, plan_dataset
from mapquilt.dataset.spec import load_spec, ready_spec
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.pair_rows import to_row
from mapquilt.jobs.journal import JOURNAL_FILE, TASKS_FILE, Journal
from mapquilt.jobs.runner import Pool, Runner
from mapquilt.json_file import to_text
from mapquilt.logs.bag_log import load_bag
from mapquilt.runs.open_world import open_world
from mapquilt.study.files import PLAN_FILE, TRIALS_FILE, load_results, trials_record
from mapquilt.study.folder import PLAN_SCHEMA
from mapquilt.study.records import Failure, MissionTrials, TeamTrial
from merge.records.evidence import Evidence
from merge.records.pair_answer import Alternative
from tests.conftest import command
from tests.mapquilt.evaluation.examples import GOOD, evaluated
from tests.mapquilt.logs.bags import Messages
from tests.mapquilt.study.conftest import plan
from worlds.families.registry import make_world
from worlds.importing.plan_file import PlanOptions
from worlds.world_file import world_to_json


def _trajectory() -> Trajectory:
    return Trajectory(np.arange(4.0), np.column_stack((np.arange(4.0), np.zeros(4), np.linspace(0.0, 1.0, 4))))


def _log() -> RobotLog:
    scans = tuple(LidarScan(float(k), -1.0, 0.5, 0.1, 9.0, np.full(4, 2.0, np.float32)) for k in range(4))
    return RobotLog(scans, _trajectory(), SE2(0.1), "robot_0")


def _carmen(folder: Path) -> bytes:
    save_carmen(folder / "x.log", _log(), _trajectory())
    return (folder / "x.log").read_bytes()


def _bag(storage: str, folder: Path) -> bytes:
    bag = Messages(storage)
    bag.transform("/tf_static", 0.0, "base", "lidar", (0.1, 0.0, 0.2, 0.0, 0.0, 0.0))
    for k in range(4):
        bag.scan("/scan", float(k), [2.0] * 4)
        bag.transform("/tf", float(k), "odom", "base", (0.1 * k, 0.0, 0.0, 0.0, 0.0, 0.1 * k))
        bag.odometry("/odom", float(k), (0.1 * k, 0.0, 0.0, 0.0, 0.0, 0.1 * k))
    return bag.write(folder).read_bytes()


def picture(kind: str) -> bytes:
    """Encode a small picture of noise."""
    grey = np.random.default_rng(1).integers(0, 255, (9, 7)).astype(np.uint8)
    return picture_bytes(Picture(grey), kind)


def _world() -> bytes:
    return json.dumps(world_to_json(make_world("house", 1))).encode()


def _mission() -> MissionPlan:
    """Return the first mission of ``SPEC``."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "spec.yaml").write_text(SPEC)
        carried = carry_plans(load_spec(f"{folder}/spec.yaml"), Path(folder))
        return plan_dataset(carried.spec, carried.worlds).missions[0]


def _manifest(folder: Path) -> bytes:
    (folder / "spec.yaml").write_text(SPEC)
    assert command("dataset", "make", folder / "spec.yaml", "--out", folder / "data", "--workers", 1) == 0
    return (folder / "data/manifest.jsonl").read_bytes()


def _dataset_journal(folder: Path) -> bytes:
    records = [json.loads(line) for line in _manifest(folder).splitlines()]
    of_mission = [one for one in records if one["kind"] in ("mission", "sample") and one["mission"] == "000000"]
    return json.dumps({"task": "0", "records": of_mission, "failures": []}).encode() + b"\n"


def _read_dataset_journal(path: Path) -> None:
    for entry in Journal[MissionPlan](path, lambda mission: str(mission.index)).entries().values():
        is_whole(path.parent, _mission_of_spec(), entry)


def _answer(level: tuple[str, ...] = ()) -> EvaluatedPair:
    evidence = Evidence(0.9, 0.95, 0.03, 0.01, 2e4, 0.5, 4.0, 900.0, 0.4, 0.7, 0.3, 1.0, None, None, 3)
    answer = Similarity2(1.0, 2.0, 0.5, 1.0)
    found = evaluated(True, GOOD, overlap=0.5, answer=answer, evidence=evidence, mission="000", level=level)
    return replace(found, alternative=Alternative(answer, 0.3))


def _pairs_csv(folder: Path) -> bytes:
    write_folder(folder, build_results([_answer()], 1), {"scale": "auto", "seed": 1}, 0)
    return (folder / "pairs.csv").read_bytes()


def _trials(folder: Path) -> bytes:
    study = plan("noise=0,1", methods=("orb",))
    (folder / PLAN_FILE).write_text(to_text({"schema": PLAN_SCHEMA, **study.record()}))
    team = TeamTrial("000", "house", ("0",), "orb", 2, 1, 0.5, 0.25, 1, 0.5)
    trials = MissionTrials(pairs=[_answer(("0",))], teams=[team], failures=[Failure("001", ("0",), "no floor")])
    return json.dumps({"task": "0", **trials_record(trials)}).encode() + b"\n"


NO_TASKS = {"methods": [], "seed": 1, "pairs": 0, "digest": sha256().hexdigest()}


def _benchmark_journal(folder: Path) -> bytes:
    (folder / TASKS_FILE).write_text(json.dumps(NO_TASKS, indent=1))
    return json.dumps({"task": "0", "rows": [to_row(_answer())], "seconds": [1.0]}).encode() + b"\n"


def _read_benchmark_journal(path: Path) -> None:
    with Runner(start=lambda: Pool(ThreadPoolExecutor(1), lambda: 1)) as runner:
        run_benchmark([], (), 1, runner, work=path.parent)


def _drawn(path: Path) -> None:
    open_world(str(path), 1, plan=PlanOptions(resolution=0.02 if path.suffix == ".svg" else None))


FLASER = b"".join(b"FLASER 4 1.0 2.0 3.0 4.0 0.%d 0 0 0.%d 0 0 %d.5 host %d.5\n" % (k, k, k, k) for k in range(1, 6))
RAWLASER = b"PARAM robot_frontlaser_offset 0.1 1.0 host 1.0\n" + b"".join(
    b"ODOM 0.%d 0 0 0 0 0 %d.1 host %d.1\nRAWLASER1 0 -1.0 2.0 0.5 9.0 0 0 4 1 2 3 4 0 %d.5 host %d.5\n"
    % (k, k, k, k, k)
    for k in range(1, 6)
)
PAIR = {"name": "p", "kind": "x", "map_a": "map.pgm", "map_b": "map.pgm", "scale": 1, "rotation_deg": 0}
PAIRS = json.dumps({"pairs": [PAIR | {"tx": 0, "ty": 0}]}).encode()
ANSWERS = b"pair,scale,rotation_deg,tx,ty,confidence,accepted,seconds\na,1.5,90,3,-4,0.75,1,0.5\nb,,,,,0,0,\n"
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

ROOM = ((0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0))
EDGES = tuple(zip(ROOM, (*ROOM[1:], ROOM[0]), strict=True))
HOUSE = json.dumps({"verts": ROOM, "id": "house", "room_category": {"kitchen": [[0, 0, 6, 4]]}}).encode()
VECTOR_MAP = json.dumps([{"p0": {"x": a, "y": b}, "p1": {"x": c, "y": d}} for (a, b), (c, d) in EDGES]).encode()
BUILDING = b"""name: clinic
levels:
  L1:
    elevation: 0
    vertices: [[0, 0, 0, ""], [300, 0, 0, ""], [300, 200, 0, ""], [0, 200, 0, ""], [100, 0, 0, ""], [150, 0, 0, ""]]
    walls: [[0, 1, {alpha: [3, 1]}], [1, 2, {}], [2, 3, {}], [3, 0, {}]]
    doors: [[4, 5, {type: [1, hinged]}]]
    measurements: [[0, 1, {distance: [3, 6.0]}]]
    fiducials: [[10, 10, a], [200, 100, b]]
"""
SVG = b"""<svg xmlns="http://www.w3.org/2000/svg" width="300" height="200"><g transform="scale(1.0)">
<path d="M0 0 H300 V200 H0 Z" stroke="black" stroke-width="5" fill="none"/>
<circle cx="150" cy="100" r="10" fill="#000"/><rect x="40" y="40" width="20" height="9" style="fill:black"/></g></svg>
"""
_SHAPE = "<collision name='c'><pose>{} 0 0 0 0</pose><geometry>{}</geometry></collision>"
_SHAPES = [
    *(_SHAPE.format(at, f"<box><size>{size} 1</size></box>") for at, size in (("0 2", "6 0.1"), ("0 -2", "6 0.1"))),
    *(_SHAPE.format(at, "<box><size>0.1 4 1</size></box>") for at in ("3 0", "-3 0")),
    _SHAPE.format("1 1", "<cylinder><radius>0.2</radius><length>1</length></cylinder>"),
]
SDF = f"<?xml version='1.0'?><sdf version='1.7'><model name='m'><link name='l'>{''.join(_SHAPES)}</link></model></sdf>"
_LINE = "0\nLINE\n8\n0\n10\n%g\n20\n%g\n30\n0\n11\n%g\n21\n%g\n31\n0\n"
DXF = (
    "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n9\n$INSUNITS\n70\n6\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n"
    + "".join(_LINE % (*start, *end) for start, end in EDGES)
    + "0\nCIRCLE\n8\n0\n10\n3\n20\n2\n30\n0\n40\n0.3\n0\nENDSEC\n0\nEOF\n"
).encode()

READERS: dict[str, tuple[str, Callable[[Path], bytes], Callable[[Path], object]]] = {
    "npz": ("log.npz", lambda folder: _saved(folder / "log.npz"), load_robot_log),
    "tum": ("path.tum", lambda folder: _saved_tum(folder / "path.tum"), load_tum),
    "relations": ("x.relations", lambda _: b"0 1 1 0 0 0 0 0.5\n", load_relations),
    "carmen": ("x.log", _carmen, load_carmen),
    "carmen, old": ("x.log", lambda _: FLASER, load_carmen),
    "carmen, raw": ("x.log", lambda _: RAWLASER, load_carmen),
    "carmen, packed": ("x.log.gz", lambda folder: gzip.compress(_carmen(folder), mtime=0), load_carmen),
    "bag": ("log.bag", partial(_bag, "bag"), load_bag),
    "mcap": ("log.mcap", partial(_bag, "mcap"), load_bag),
    "db3": ("log.db3", partial(_bag, "db3"), load_bag),
    "pgm": ("map.pgm", lambda _: picture("pgm"), read_picture),
    "png": ("map.png", lambda _: picture("png"), read_picture),
    "map": ("map.yaml", lambda _: MAP_YAML, load_map),
    "json": ("x.json", lambda _: _world(), read_json),
    "jsonl": ("x.jsonl", _manifest, read_json_lines),
    "yaml": ("x.yaml", lambda _: SMOKE, read_yaml),
    "world": ("world.json", lambda _: _world(), _drawn),
    "houseexpo": ("house.json", lambda _: HOUSE, _drawn),
    "vector map": ("lab.vectormap.json", lambda _: VECTOR_MAP, _drawn),
    "building": ("clinic.building.yaml", lambda _: BUILDING, _drawn),
    "svg": ("plan.svg", lambda _: SVG, _drawn),
    "dxf": ("plan.dxf", lambda _: DXF, _drawn),
    "sdf": ("plan.sdf", lambda _: SDF.encode(), _drawn),
    "pairs": ("pairs.json", lambda _: PAIRS, read_pair_list),
    "answers": ("answers.csv", lambda _: ANSWERS, lambda path: read_answers(path, "mine", ("a", "b"))),
    "pairs.csv": ("pairs.csv", _pairs_csv, lambda path: load_answers(path.parent)),
    "manifest": ("manifest.jsonl", _manifest, lambda path: read_manifest(path.parent)),
    "spec": ("spec.yaml", lambda _: SMOKE, lambda path: load_spec(str(path))),
    "journal of a data set": (JOURNAL_FILE, _dataset_journal, _read_dataset_journal),
    "journal of a benchmark": (JOURNAL_FILE, _benchmark_journal, _read_benchmark_journal),
    "trials": (TRIALS_FILE, _trials, lambda path: load_results(path.parent)),
}
"""File name, the content by our own writer, and the reader."""

HOSTILE_FIELDS = (
    *("world", "houseexpo", "vector map", "pairs", "manifest"),
    *("journal of a data set", "journal of a benchmark", "trials"),
)
"""Readers of JSON whose fields get hostile values."""


def _saved(path: Path) -> bytes:
    save_robot_log(path, _log())
    return path.read_bytes()


def _saved_tum(path: Path) -> bytes:
    save_tum(path, _trajectory())
    return path.read_bytes()


_mission_of_spec = cache(_mission)


@cache
def content(reader: str) -> tuple[bytes, dict[str, bytes]]:
    """Return a file of the reader's kind, as our own writer makes it, and those that are written beside it."""
    with tempfile.TemporaryDirectory() as folder:
        data = READERS[reader][1](Path(folder))
        beside = {path.name: path.read_bytes() for path in Path(folder).iterdir() if path.is_file()}
        return data, beside | {"map.pgm": picture("pgm")}
