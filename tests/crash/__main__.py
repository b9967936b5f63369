"""Print a table of kills: ``python -m tests.crash --kills 60``. Exit status 1 if a result was mixed or lost."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import cv2

from tests.crash.cases import make_cases
from tests.crash.kills import Case, killed, prepare, recovered, states

PLAIN_SHARE = 6
"""Kills of a verb for one of a job that is resumed, which runs twice and longer."""


def main() -> int:
    """Kill each verb at its changes in turn, and compare what is left with the state before and after.

    A data set, a study or a calibration is continued by the same command, and compared with the state after.
    """
    parser = argparse.ArgumentParser(prog="python -m tests.crash", description=__doc__)
    parser.add_argument("--kills", type=int, help="greatest number of kills; default: one at each change")
    parser.add_argument("--only", metavar="VERB", default="", help="kill the verbs whose title begins so")
    chosen = parser.parse_args()
    kills = chosen.kills
    cv2.setNumThreads(0)  # a forked process would wait for ever for the threads of its parent
    with tempfile.TemporaryDirectory(prefix="mapquilt-crash-") as folder:
        work = Path(folder).resolve()
        cases = [case for case in make_cases(work) if case.name.startswith(chosen.only)]
        print(f"{'verb':24}{'kills':>7}{'all old':>9}{'all new':>9}{'mixed':>7}{'lost':>6}")
        totals = [0] * 5
        shares = [1 if case.resumed else PLAIN_SHARE for case in cases]
        for index, (case, share) in enumerate(zip(cases, shares, strict=True)):
            most = None if kills is None else (kills - totals[0]) * share // sum(shares[index:])
            counts = _kill(case, work, most)
            totals = [total + count for total, count in zip(totals, counts, strict=True)]
            _print(case.name, counts)
        _print("all", totals)
    return 1 if totals[3] or totals[4] else 0


def _print(name: str, counts: list[int]) -> None:
    kills, old, new, mixed, lost = counts
    print(f"{name:24}{kills:7}{old:9}{new:9}{mixed:7}{lost:6}", flush=True)


def _kill(case: Case, work: Path, most: int | None) -> list[int]:
    """Count kills, results that are all old, all new or mixed, and kills after which a file of others was lost."""
    old, new, changes = states(case, work)
    if old == new:
        raise RuntimeError(f"{case.name}: leaves the folder as it was, so that a kill shows nothing")
    counts, most = [0] * 5, changes if most is None else min(most, changes)
    for number in range(most):  # evenly over all changes, the last ones included
        prepare(case)
        if not killed(case, changes - number * changes // most, work)[0]:
            continue
        found = recovered(case, work)
        counts[0] += 1
        counts[1 if found == old else 2 if found == new else 3] += 1
        counts[4] += "notes.txt" in old and found.get("notes.txt") != old["notes.txt"]
    return counts


if __name__ == "__main__":
    sys.exit(main())
