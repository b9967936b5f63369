"""The verbs that are killed, each over an older result and over nothing."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from mapping.geometry.similarity2 import Similarity2
from mapping.io.transaction import COMMIT
from mapquilt.align.open_task import open_task
from mapquilt.align.saving import save
from mapquilt.align.workspace import Workspace
from mapquilt.cli.app import run
from tests.crash.kills import Case, killed, prepare, states

SIMULATE = ("simulate", "office", "--robots", "2", "--duration", "6")
ONE = ("--workers", "1")
SPEC = """
name: crash
seed: 1
missions: [{world: office, count: 4, robots: 2, duration: 15}]
samples: {per_mission: 1, poses: [odometry]}
other_worlds: 2
splits: {train: 0.5, test: 0.5}
"""
"""The smallest set on which the confidence can be fitted: some answers are right, and some are wrong."""

SMALL_SPEC = """
name: crash
seed: 1
missions: [{world: office, count: 2, robots: 2, duration: 6}]
samples: {per_mission: 1, poses: [odometry]}
splits: {test: 1.0}
"""
STUDY = ("--vary", "noise=0,1", "--set", "robots=2", "--set", "duration=4", "--method", "orb", "--missions", "1")


def make_cases(work: Path) -> list[Case]:
    """Make the folders that the verbs start from, and list the cases."""
    base, merged, first, maps = (work / name for name in ("base", "merged", "first", "maps"))
    _run(*SIMULATE, "--seed", "3", "--out", base)
    shutil.copytree(base, merged)
    _run("merge", merged)
    shutil.copytree(merged, first)
    _run("score", first)
    pair = ("merge", base / "robot_0/map.pgm", base / "robot_1/map.pgm")
    _run(*pair, "--out", maps)
    truth = {"scale": 1.0, "rotation_deg": 0.0, "tx": 0.0, "ty": 0.0}
    names = {"map_a": "base/robot_0/map.yaml", "map_b": "base/robot_1/map.yaml"}
    pairs = work / "pairs.json"
    pairs.write_text(json.dumps({"pairs": [{"name": "one", "kind": "cut", **names, **truth}]}))
    bench = work / "bench"
    benchmark = ("benchmark", "--pairs", pairs, "--method", "orb", *ONE)
    _run(*benchmark, "--seed", "1", "--pictures", "0", "--out", bench)
    plan = work / "plan.png"
    _run("worlds", "draft", "office", "--seed", "3", "--style", "hollow", "--out", plan)
    located = work / "located"
    locate = ("locate", base / "robot_0/map.yaml", plan)
    _run(*locate, "--out", located)
    out = work / "out"
    verbs: list[tuple[str, tuple[object, ...], Path | None]] = [
        ("simulate, new", (*SIMULATE, "--seed", "4", "--out", out), None),
        ("simulate, over a run", (*SIMULATE, "--seed", "4", "--out", out), first),
        ("sense, over a run", ("sense", base, "--noise", "2", "--out", out), first),
        ("merge, of a run", ("merge", out, "--seed", "3", "--min-confidence", "0.05"), first),
        ("merge, over a merge", (*pair, "--seed", "3", "--out", out), maps),
        ("merge --add, to a run", ("merge", out, "--add", maps / "inputs/0/map.pgm", "--force"), first),
        ("merge --add, to a merge", ("merge", out, "--add", first / "robot_1/map.yaml", "--force"), maps),
        ("score", ("score", out), merged),
        ("map", ("map", base / "robot_0/log.npz", "--out", out), None),
        ("slam-eval", ("slam-eval", base, "--robot", "robot_0", "--reference", base, "--out", out), None),
        ("report", ("report", out), first),
        ("convert, to TUM", ("convert", base, out, "--to", "tum"), None),
        ("worlds make", ("worlds", "make", "house", "--seed", "2", "--out", out / "house.json"), _world(work)),
        ("locate, over one", (*locate, "--seed", "2", "--out", out), located),
        ("benchmark, new", (*benchmark, "--pictures", "0", "--out", out), None),
        ("benchmark, over one", (*benchmark, "--seed", "2", "--pictures", "0", "--out", out), bench),
        ("benchmark export, new", ("benchmark", "export", "--pairs", pairs, "--out", out), None),
    ]
    cases = [Case(name, _verb(arguments), out, before) for name, arguments, before in verbs]
    files = base / "robot_0/map.yaml", base / "robot_1/map.yaml"
    pages = [
        Case("align, new", partial(_align, files, out), out, None),
        Case("align, over a merge", partial(_align, files, out), out, maps),
        Case("align, of a run", partial(_align, (out,), None), out, first),
    ]
    return cases + pages + _jobs(work, out)


def _align(paths: Sequence[Path], out: Path | None) -> int:
    """Move a map and save, as the page of ``align`` does."""
    workspace = Workspace(open_task(paths, out))
    workspace.place(1, Similarity2(0.5, 0.25, 0.1) @ workspace.arrangement.placements[1].sheet_from_map)
    save(workspace, workspace.stitch(), yaw_zero=True, frame_of=1)
    return 0


def _verb(arguments: Sequence[object]) -> Callable[[], int]:
    return partial(run, [str(argument) for argument in arguments])


def _world(work: Path) -> Path:
    folder = work / "worlds"
    folder.mkdir()
    _run("worlds", "make", "house", "--seed", "1", "--out", folder / "house.json")
    return folder


def _jobs(work: Path, out: Path) -> list[Case]:
    """Make data sets, and list the verbs that continue after a kill."""
    for name, spec in (("fit", SPEC), ("small", SMALL_SPEC)):
        (work / f"{name}.yaml").write_text(spec)
        _run("dataset", "make", work / f"{name}.yaml", "--out", work / name, *ONE)
    merge = Case("merge, of a data set", _verb(("merge", out, *ONE)), out, work / "small", resumed=True)
    verbs: list[tuple[str, tuple[object, ...], Path | None]] = [
        ("dataset make", ("dataset", "make", work / "small.yaml", "--out", out, *ONE), None),
        ("dataset verify --repair", ("dataset", "verify", out, "--repair"), _half_merged(merge, work)),
        ("study", ("study", *STUDY, "--out", out, *ONE), None),
        ("calibrate", ("calibrate", "--dataset", work / "fit", "--out", out, *ONE), None),
    ]
    export = _verb(("dataset", "export", work / "small", "--pairs-per-file", "2", "--out", out))
    disturb = _verb(("dataset", "disturb", work / "fit", "--overlap", "0:1", "--out", out))
    continued = [Case(name, _verb(arguments), out, before, True) for name, arguments, before in verbs]
    return [
        Case("dataset disturb", disturb, out, None),
        Case("dataset export", export, out, None),
        merge,
        *continued,
    ]


def _half_merged(merge: Case, work: Path) -> Path:
    """Return a data set whose merge was killed when its files had to move to their places."""
    folder = work / "half"
    for change in range(states(merge, work)[2], 0, -1):
        prepare(merge)
        if killed(merge, change, work)[0] and any(merge.out.rglob(f"{COMMIT}/journal.json")):
            return Path(shutil.move(merge.out, folder))
    raise RuntimeError("no kill left a transaction to finish")


def _run(*arguments: object) -> None:
    status = run([str(argument) for argument in arguments])
    if status not in (0, 1):
        raise RuntimeError(f"{arguments[0]}: ended with status {status}")
