"""Add results to the leaderboard, and check them.

``python -m benchmarks.leaderboard answers BENCH METHOD --dataset DATA --out leaderboard/SET/NAME.csv`` writes the
answers of a method that ``mapquilt benchmark`` ran, in the form in which any other program hands in its own.
``python -m benchmarks.leaderboard add leaderboard/SET/NAME.csv --dataset DATA ...`` scores answers and writes the
result file beside them. ``python -m benchmarks.leaderboard check --dataset DATA`` scores the answers of every result
on that data again and exits with 1 if a number differs; without data it checks the files alone.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from benchmarks.leaderboard.result_file import ORIGINS, ROOT, SCHEMA
from benchmarks.leaderboard.scoring import answer_rows, check, scored, write_answers
from mapping.io.atomic import write_bytes_atomically
from mapping.seeds import Role, stream
from mapquilt.benchmark.exchange.identity import by_identity, data_digest
from mapquilt.benchmark.files import load_answers
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.pair_sets import dataset_pairs, even_sample
from mapquilt.json_file import to_text


def result_record(arguments: argparse.Namespace, pairs: Mapping[str, BenchmarkPair]) -> dict[str, Any]:
    """Build the content of a result file from the command line, and score the answers."""
    return {
        "schema": SCHEMA,
        **{name: getattr(arguments, name) for name in ("method", "version", "reference", "ran_by", "origin", "date")},
        "note": arguments.note,
        "data": {
            "name": arguments.answers.resolve().parent.name,
            "digest": data_digest(list(pairs.values())),
            "split": arguments.split,
            "limit": arguments.limit,
            "pairs": len(pairs),
            "made_by": arguments.made_by,
        },
        **scored(arguments.answers, pairs),
    }


def chosen_pairs(dataset: Path, split: str | None, limit: int | None) -> dict[str, BenchmarkPair]:
    """Read the pairs of a data set by their names, or an even sample of them as ``benchmark --limit`` draws it."""
    pairs = dataset_pairs(dataset, split)
    return by_identity(pairs if limit is None else even_sample(pairs, limit, stream(0, Role.BENCHMARK_SAMPLE)))


def _parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    commands = parser.add_subparsers(dest="command", required=True)
    answers = commands.add_parser("answers", help="write the answers of a method that mapquilt benchmark ran")
    answers.add_argument("bench", type=Path)
    answers.add_argument("method", help="title of the method, such as 'orb as published'")
    answers.add_argument("--out", type=Path, required=True, help="answers file to write")
    add = commands.add_parser("add", help="score an answers file and write the result file beside it")
    add.add_argument("answers", type=Path)
    for name, text in (
        ("--method", "name of the method"),
        ("--version", "version or commit of its program"),
        ("--ran-by", "name of who ran it"),
        ("--date", "day of the run, YYYY-MM-DD"),
        ("--made-by", "command that makes the data set"),
    ):
        add.add_argument(name, required=True, help=text)
    add.add_argument("--origin", choices=ORIGINS, required=True)
    add.add_argument("--reference", default="", help="paper of the method")
    add.add_argument("--note", default="")
    for each in (answers, add):
        each.add_argument("--dataset", type=Path, required=True)
        each.add_argument("--split")
    checked = commands.add_parser("check", help="check all result files, and recompute those whose data is given")
    checked.add_argument("--dataset", type=Path, action="append", default=[])
    for each in (answers, add, checked):
        each.add_argument("--limit", type=int, help="number of pairs, drawn as by mapquilt benchmark --limit")
    checked.add_argument("--split")
    checked.add_argument("--root", type=Path, default=ROOT)
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, and return its exit status."""
    parsed, console = _parsed(arguments), Console(soft_wrap=True)
    if parsed.command == "check":
        at_hand = [chosen_pairs(folder, parsed.split, parsed.limit) for folder in parsed.dataset]
        found = check(parsed.root, at_hand)
        for path, lines in found.items():
            state = "not recomputed: its data is not at hand" if lines is None else "differs" if lines else "agrees"
            console.print(f"{path}: {state}", *(lines or ()), sep="\n")
        return 1 if any(found.values()) else 0
    pairs = chosen_pairs(parsed.dataset, parsed.split, parsed.limit)
    if parsed.command == "answers":
        answers = [one for one in load_answers(parsed.bench)[1] if one.method == parsed.method]
        if not answers:
            raise ValueError(f"{parsed.bench}: has no method {parsed.method!r}")
        write_answers(parsed.out, answer_rows(answers, pairs))
        console.print(f"{parsed.out}: {len(pairs)} answers")
        return 0
    path = parsed.answers.with_suffix(".json")
    write_bytes_atomically(path, to_text(result_record(parsed, pairs)).encode())
    console.print(f"{path}: written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
