"""``make regression`` and ``make regression-update``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Annotated

import typer

from mapquilt.cli.options.workers import SchedulerOption, WorkersOption, chosen_workers
from mapquilt.cli.tables import print_table
from mapquilt.jobs.progress import count_progress
from mapquilt.jobs.runner import Runner, Workers
from mapquilt.viz.text_table import plain_table
from tests.regression.compare import FAILING, HEADINGS, Change, compare
from tests.regression.golden import GoldenFiles, GoldenPair, read_golden, write_golden
from tests.regression.pairs import all_pairs, evaluate, family_samples
from worlds.families.registry import FAMILIES

OUTCOMES = ("true accept", "false reject", "false accept", "true reject")
WORST_FIRST = list(HEADINGS)


def regression(
    golden: Annotated[Path, typer.Option(help="Folder of the golden files.")] = Path("tests/golden"),
    update: Annotated[bool, typer.Option("--update", help="Rewrite the golden files with what is now.")] = False,
    family: Annotated[list[str] | None, typer.Option(help="Of these families alone. Repeatable.")] = None,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
) -> int:
    """Generate the fixed pairs afresh, merge them by the default method, and compare with the golden files.

    Status 1 where a merge got worse, or a sample or the set of pairs changed.
    """
    chosen = _families(family)
    if update and family:
        raise ValueError("--update: rewrites all families; leave out --family")
    before = {name: found for name, found in read_golden(golden).items() if name in chosen or not family}
    if not before and not update:
        raise ValueError(f"{golden}: holds no golden file; make regression-update writes them")
    now = _run(chosen, chosen_workers(workers, scheduler), with_others=not family)
    if family:
        before = {name: {key: one for key, one in found.items() if key in now[name]} for name, found in before.items()}
    changes = [
        change
        for name in [*chosen, *(gone for gone in before if gone not in chosen)]
        for change in compare(name, before.get(name, {}), now.get(name, {}))
    ]
    _print(before, now, changes)
    failing = [change for change in changes if change.kind in FAILING]
    if update:
        write_golden(golden, now)
        print_table(f"{golden}: {_number(now)} pairs written, {len(changes)} changed; look at them before you commit")
        return 0
    if failing:
        print_table(f"{len(failing)} of {_number(now)} pairs fail; if that is meant, run make regression-update")
        return 1
    print_table(f"{_number(now)} pairs are as they were, or better")
    return 0


def _families(given: Sequence[str] | None) -> list[str]:
    for name in given or ():
        if name not in FAMILIES:
            raise ValueError(f"--family {name}: unknown; known are {', '.join(FAMILIES)}")
    return [name for name in FAMILIES if not given or name in given]


def _run(families: Sequence[str], workers: Workers, with_others: bool) -> GoldenFiles:
    with Runner(workers) as runner:
        with count_progress("missions") as on_progress:
            samples = dict(zip(families, runner.run(family_samples, families, on_progress), strict=True))
        pairs = [pair for pair in all_pairs(samples) if with_others or pair.transform is not None]
        with count_progress("merges") as on_progress:
            found = runner.run(evaluate, pairs, on_progress)
    return {
        family: {pair.name: one for pair, one in zip(pairs, found, strict=True) if pair.family == family}
        for family in families
    }


def _print(
    before: Mapping[str, Mapping[str, GoldenPair]],
    now: Mapping[str, Mapping[str, GoldenPair]],
    changes: Sequence[Change],
) -> None:
    table = plain_table(("family", False), *((outcome, True) for outcome in OUTCOMES))
    for family in now:
        table.add_row(family, *_counts(list(before.get(family, {}).values()), list(now[family].values())))
    every = [[one for found in files.values() for one in found.values()] for files in (before, now)]
    table.add_section()
    table.add_row("all", *_counts(*every))
    print_table(table)
    ordered = sorted(changes, key=lambda change: WORST_FIRST.index(change.kind))
    for kind, group in groupby(ordered, key=lambda change: change.kind):
        print_table(f"\n{HEADINGS[kind]}:")
        for change in group:
            print_table(f"  {change.family}: {change.pair}: {change.words}")


def _counts(before: Sequence[GoldenPair], now: Sequence[GoldenPair]) -> list[str]:
    counts = Counter[str](one.outcome for one in now)
    old = Counter[str](one.outcome for one in before or now)
    return [str(counts[name]) if counts[name] == old[name] else f"{old[name]} -> {counts[name]}" for name in OUTCOMES]


def _number(now: Mapping[str, Mapping[str, GoldenPair]]) -> int:
    return sum(len(found) for found in now.values())
