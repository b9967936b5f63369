"""The surroundings of the command: streams that are closed, settings of matplotlib, few resources."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.figure
import pytest

from mapquilt.viz.png import default_style, figure_png

ROOT = Path(__file__).parents[3]
MAPQUILT = f"PYTHONPATH={ROOT} {sys.executable} -m mapquilt"


def shell(text: str, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["sh", "-c", text], cwd=cwd, capture_output=True, text=True)


def test_a_closed_output_is_named() -> None:
    done = shell(f"{MAPQUILT} lidars >&-")
    assert done.returncode == 2
    assert done.stderr == "mapquilt: standard output: is closed; redirect it to /dev/null to discard it\n"


@pytest.mark.parametrize(("streams", "status"), [("<&-", 0), ("2>&-", 0), ("<&- 2>&-", 0), (">&- 2>&-", 2)])
def test_closed_streams_do_no_harm(fresh_run: Path, streams: str, status: int) -> None:
    done = shell(f"{MAPQUILT} score {fresh_run} {streams}")
    assert done.returncode == status
    assert (fresh_run / "score.json").read_bytes().startswith(b"{")
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("most", [6, 10])
def test_few_descriptors_end_in_one_line(fresh_run: Path, most: int) -> None:
    done = shell(f"ulimit -n {most}; {MAPQUILT} merge {fresh_run}")
    assert done.returncode in (0, 1) or (done.returncode == 2 and done.stderr.count("\n") == 1), done.stderr


@pytest.mark.parametrize("kilobytes", [300_000, 400_000, 600_000, 1_500_000])
def test_too_little_memory_ends_in_one_line(kilobytes: int) -> None:
    """OpenBLAS spins for ever as it is loaded within 400 MB."""
    done = shell(f"ulimit -v {kilobytes}; {MAPQUILT} merge a.pgm b.pgm --out merged")
    assert done.returncode == 2
    assert done.stderr.startswith(f"mapquilt: ulimit -v is {kilobytes} kB, must be at least ")
    assert done.stderr.count("\n") == 1


def test_a_system_that_is_not_posix_is_named() -> None:
    done = shell(f"PYTHONPATH={ROOT} {sys.executable} -c 'import mapquilt.__main__ as m; m.os.name = \"nt\"; m.main()'")
    assert done.returncode == 2
    assert done.stderr.startswith("mapquilt: needs a POSIX system")


def test_settings_of_matplotlib_do_not_change_a_picture(merged_run: Path, tmp_path: Path) -> None:
    pictures = []
    for rc in ("", "font.size: 30\naxes.facecolor: red\nsavefig.dpi: 40\ntext.usetex: True\nimage.origin: lower\n"):
        folder = tmp_path / f"work{len(rc)}"
        folder.mkdir()
        if rc:
            (folder / "matplotlibrc").write_text(rc)
        for verb in (f"simulate office --robots 2 --duration 4 --out {folder}/run", f"merge {folder}/run"):
            done = shell(f"{MAPQUILT} {verb}", folder)
            assert done.returncode in (0, 1), done.stderr
        pictures.append([(folder / "run" / name).read_bytes() for name in ("coverage.png", "merge.png")])
    assert pictures[0] == pictures[1]


@pytest.mark.parametrize("name", ["$_$", "a$_$b", r"$\frac{", "$$", "$x$"])
def test_names_are_text_and_not_formulas(name: str) -> None:
    @default_style()
    def figure() -> mpl.figure.Figure:
        drawn = mpl.figure.Figure(figsize=(2, 2))
        panel = drawn.add_subplot(title=name, xlabel=name)
        panel.plot([0, 1], label=name)
        panel.legend()
        return drawn

    assert figure_png(figure()).startswith(b"\x89PNG")


def test_a_name_of_one_formula_is_drawn_as_it_is_spelt() -> None:
    @default_style()
    def title(text: str) -> bytes:
        figure = mpl.figure.Figure(figsize=(2, 1))
        figure.text(0.1, 0.5, text)
        return figure_png(figure)

    assert title("$x$") != title("x")
    assert title("$x$") == title("$x$")
