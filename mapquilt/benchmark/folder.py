"""The folder that a benchmark leaves."""

from __future__ import annotations

from pathlib import Path

from mapping.io.atomic import folder_aside
from mapquilt.benchmark.files import SUMMARY_FILE, write_files
from mapquilt.benchmark.report import Report
from mapquilt.jobs.runner import Progress, no_progress
from mapquilt.runs.folder import refuse_foreign
from mapquilt.viz.pair_sheet import in_order, sheet_pages
from mapquilt.viz.png import figure_png
from mapquilt.viz.reliability import reliability_figure

RELIABILITY_PICTURE = "reliability.png"
SHEETS_FOLDER = "sheets"


def claim_folder(out: Path) -> None:
    """Raise ``ValueError`` where the folder holds what no benchmark wrote."""
    refuse_foreign(out, SUMMARY_FILE)


def write_folder(out: Path, report: Report, pictures: int, on_progress: Progress = no_progress) -> None:
    """Write tables, records and pictures, whole or not at all; a benchmark of that name is replaced.

    At most so many pairs a method are drawn, those that went wrong before the others.
    """
    claim_folder(out)
    with folder_aside(out) as folder:
        write_files(folder, report)
        if report.calibrations:
            (folder / RELIABILITY_PICTURE).write_bytes(figure_png(reliability_figure(report.calibrations)))
        if pictures:
            _write_sheets(folder / SHEETS_FOLDER, report, pictures, on_progress)


def _write_sheets(folder: Path, report: Report, pictures: int, on_progress: Progress) -> None:
    folder.mkdir()
    for method, settings in enumerate(report.methods):
        shown = in_order(report.trials, method)[:pictures]
        name = settings.title.replace(" ", "-")
        for number, page in enumerate(sheet_pages(shown, method), start=1):
            (folder / f"{name}-{number:02d}.png").write_bytes(page)
        on_progress(method + 1, len(report.methods))
