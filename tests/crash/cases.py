"""The verbs that are killed, each over an older result and over nothing."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

from mapquilt.cli.app import run
from tests.crash.kills import Case

SIMULATE = ("simulate", "office", "--robots", "2", "--duration", "6")


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
    benchmark = ("benchmark", "--pairs", pairs, "--method", "orb")
    _run(*benchmark, "--seed", "1", "--pictures", "0", "--out", bench)
    out = work / "out"
    verbs: list[tuple[str, tuple[object, ...], Path | None]] = [
        ("simulate, new", (*SIMULATE, "--seed", "4", "--out", out), None),
        ("simulate, over a run", (*SIMULATE, "--seed", "4", "--out", out), first),
        ("sense, over a run", ("sense", base, "--noise", "2", "--out", out), first),
        ("merge, of a run", ("merge", out, "--seed", "3", "--min-confidence", "0.05"), first),
        ("merge, over a merge", (*pair, "--seed", "3", "--out", out), maps),
        ("score", ("score", out), merged),
        ("map", ("map", base / "robot_0/log.npz", "--out", out), None),
        ("report", ("report", out), first),
        ("convert, to TUM", ("convert", base, out, "--to", "tum"), None),
        ("benchmark, new", (*benchmark, "--pictures", "0", "--out", out), None),
        ("benchmark, over one", (*benchmark, "--seed", "2", "--pictures", "0", "--out", out), bench),
    ]
    return [Case(name, tuple(map(str, arguments)), out, before) for name, arguments, before in verbs]


def _run(*arguments: object) -> None:
    status = run([str(argument) for argument in arguments])
    if status not in (0, 1):
        raise RuntimeError(f"{arguments[0]}: ended with status {status}")
