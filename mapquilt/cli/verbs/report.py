"""``mapquilt report``: write one HTML file."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from mapping.io.atomic import write_bytes_atomically
from mapping.io.transaction import change_files, finish_transaction
from mapping.wording import counted
from mapquilt.benchmark.files import SUMMARY_FILE
from mapquilt.cli.tables import print_table
from mapquilt.dataset.manifest import is_dataset
from mapquilt.jobs.progress import count_progress, mapping_label
from mapquilt.report.content import Content
from mapquilt.runs.folder import MERGE_FILE, is_run
from mapquilt.study.files import is_study

REPORT_FILE = "report.html"


def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run, data set, benchmark or study.")],
    out: Annotated[
        Path | None, typer.Option(help="HTML file to write; an older one is replaced. [default: DIR/report.html]")
    ] = None,
    pictures: Annotated[
        int, typer.Option(min=0, help="Greatest number of pairs to draw; up to half of them errors.")
    ] = 200,
) -> int:
    """Write one self-contained HTML file: summary, charts, and every pair with its maps, merge and truth.

    Example: mapquilt report runs/office
    """
    path = folder / REPORT_FILE if out is None else out
    with count_progress(f"{mapping_label()}, scans") as on_scans:
        content = read_content(folder, on_scans)
    from mapquilt.report.page import render_page

    with count_progress("pictures") as on_progress:
        page = render_page(content, pictures, on_progress)
    if path.parent.resolve() == folder.resolve():
        change_files(folder, {path: page.encode()}, (), ledger=True)
    else:
        write_bytes_atomically(path, page.encode())
    print_table(
        f"{path}: {counted(len(content.answers), 'answer')} of the {content.kind} {content.name}, "
        f"{len(page) / 1e6:.1f} MB"
    )
    return 0


def read_content(folder: Path, on_scans: Callable[[int, int], None] = lambda done, total: None) -> Content:
    """Read the content of a folder; ``on_scans`` gets the scans that are mapped again and their total.

    Raises ``ValueError`` naming the folder if mapquilt wrote no such one.
    """
    if not folder.is_dir():
        raise ValueError(f"{folder}: no such folder")
    finish_transaction(folder)
    if is_run(folder):
        from mapquilt.align.embedded import embedded_page
        from mapquilt.report.of_run import run_content
        from mapquilt.report.pose_graphs import pose_graphs

        content = run_content(folder)
        page = embedded_page(folder) if (folder / MERGE_FILE).is_file() else None
        pictures = [*content.pictures, *pose_graphs(folder, on_scans)]
        return dataclasses.replace(content, pictures=pictures, maps_page=page)
    if is_dataset(folder):
        from mapquilt.report.of_dataset import dataset_content

        return dataset_content(folder)
    if is_study(folder):
        from mapquilt.report.of_study import study_content

        return study_content(folder)
    if (folder / SUMMARY_FILE).is_file():
        from mapquilt.report.of_benchmark import benchmark_content

        return benchmark_content(folder)
    raise ValueError(f"{folder}: is no run, finished data set, benchmark or study of mapquilt")
