"""Start and end of the command: without a cache, interrupted early, and with a closed pipe."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from mapping.io.map_file import save_map
from mapquilt.cli.app import VERBS, run
from tests.mapquilt.cli.test_app import office_map

ROOT = Path(__file__).parents[3]
ROOMS = ("mapping", "worlds", "sim", "merge", "mapquilt")
COMMAND = (sys.executable, "-m", "mapquilt")

INTERRUPTED_IMPORT = """
import os, signal, sys

class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == "numba":
            os.kill(os.getpid(), signal.SIGINT)

signal.signal(signal.SIGINT, signal.default_int_handler)
sys.meta_path.insert(0, Interrupt())
from mapquilt.__main__ import main
main()
"""


@pytest.fixture
def read_only(tmp_path: Path) -> Iterator[dict[str, str]]:
    """An environment whose mapquilt, home and cache cannot be written to, not even by root."""
    install = tmp_path / "install"
    for room in ROOMS:
        shutil.copytree(ROOT / room, install / room, ignore=shutil.ignore_patterns("__pycache__"))
    for folder in [path for path in install.rglob("*") if path.is_dir()]:
        (folder / "__pycache__").write_text("no folder")
    (tmp_path / "tmp").mkdir()
    yield os.environ | {
        "PYTHONPATH": str(install),
        "PYTHONDONTWRITEBYTECODE": "1",
        "HOME": os.devnull,
        "XDG_CACHE_HOME": f"{os.devnull}/cache",
        "NUMBA_CACHE_DIR": f"{os.devnull}/numba",
        "MPLCONFIGDIR": str(tmp_path / "tmp"),
        "TMPDIR": str(tmp_path / "tmp"),
    }
    assert [path.name for path in (tmp_path / "tmp").iterdir() if path.name.startswith("mapquilt-")] == []


def test_a_read_only_installation_works_without_a_cache(read_only: dict[str, str], tmp_path: Path) -> None:
    for name in ("a", "b"):
        save_map(office_map(), tmp_path / name)
    for arguments in (["--help"], ["merge", "a.yaml", "b.yaml", "--out", "merged"]):
        done = subprocess.run(
            [*COMMAND, *arguments], cwd=tmp_path, env=read_only, capture_output=True, text=True, check=False
        )
        assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "merged/merge.json").is_file()


def test_an_interrupt_while_the_command_loads_is_quiet() -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_IMPORT], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "mapquilt: interrupted\n")


@pytest.mark.parametrize("arguments", [("worlds", "list"), ("--help",), ("--version",)])
def test_a_closed_pipe_ends_the_command_quietly(arguments: tuple[str, ...]) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run([*COMMAND, *arguments], cwd=ROOT, stdout=writer, stderr=subprocess.PIPE, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (128 + signal.SIGPIPE, b"")


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("arguments", [("worlds", "list"), ("--help",), ("--version",)])
def test_a_full_disk_of_standard_output_is_reported_once(arguments: tuple[str, ...], unbuffered: str) -> None:
    environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run(
            [*COMMAND, *arguments], cwd=ROOT, env=environment, stdout=full, stderr=subprocess.PIPE, check=False
        )
    assert (done.returncode, done.stderr) == (2, b"mapquilt: standard output: No space left on device\n")


def test_libraries_of_some_commands_are_not_loaded_by_others() -> None:
    loaded = "import mapquilt.cli.app, sys; print(*(set(sys.argv[1:]) & set(sys.modules)))"
    late = ("scipy.stats", "scipy.optimize", "matplotlib", "jinja2", "dask", "pybullet")
    done = subprocess.run([sys.executable, "-c", loaded, *late], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_help_loads_no_verb() -> None:
    """``mapquilt --help`` lists the verbs without the libraries that they need."""
    program = (
        "import sys; from mapquilt.cli.app import run; run(['--help']); "
        "sys.exit(','.join({'numpy', 'numba', 'cv2', 'scipy', 'pydantic'} & set(sys.modules)))"
    )
    listed = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert listed.stderr == "\n"
    for name, (_, line) in VERBS.items():
        assert f"{name} " in listed.stdout and line[:40] in listed.stdout


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_loads_and_has_a_help(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([verb, "--help"]) == 0
    assert f"Usage: mapquilt {verb} " in capsys.readouterr().out


def test_merging_map_files_loads_no_simulator() -> None:
    loaded = "{'sim', 'worlds', 'pydantic'} & set(sys.modules)"
    program = f"import sys; import mapquilt.cli.verbs.merge; sys.exit(','.join({loaded}))"
    assert subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True).stderr == "\n"
