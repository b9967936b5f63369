"""Content of the wheel and the lock file."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = ("mapping", "worlds", "sim", "merge", "mapquilt")


@pytest.mark.parametrize("room", ROOMS)
def test_each_package_is_loaded_from_the_repository(room: str) -> None:
    loaded = importlib.import_module(room).__file__
    assert loaded is not None
    assert Path(loaded).parent == ROOT / room


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built wheel, unpacked; built from a copy, so that no build folder is left in the repository."""
    source = tmp_path_factory.mktemp("source")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    for room in ROOMS:
        shutil.copytree(ROOT / room, source / room, ignore=shutil.ignore_patterns("__pycache__"))
    options = ("--no-index", "--no-deps", "--no-build-isolation", "--disable-pip-version-check", "--quiet")
    command = [sys.executable, "-m", "pip", "wheel", *options, "--wheel-dir", str(source / "dist"), str(source)]
    built = subprocess.run(command, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    (archive,) = (source / "dist").glob("mapquilt-*.whl")
    unpacked = tmp_path_factory.mktemp("wheel")
    zipfile.ZipFile(archive).extractall(unpacked)
    return unpacked


def test_the_wheel_holds_every_source_and_data_file(wheel: Path) -> None:
    kinds = ("*.py", "py.typed", "*.json", "*.png", "*.yaml", "*.j2", "*.css", "*.js", "*.html")
    wanted = {path.relative_to(ROOT) for room in ROOMS for kind in kinds for path in (ROOT / room).rglob(kind)}
    packed = {path.relative_to(wheel) for room in ROOMS for path in (wheel / room).rglob("*") if path.is_file()}
    assert packed == wanted
    assert {path.parent.name for path in packed if path.name == "py.typed"} >= set(ROOMS)


def test_the_wheel_holds_no_tests(wheel: Path) -> None:
    assert {path.name for path in wheel.iterdir() if path.suffix != ".dist-info"} == set(ROOMS)


def test_the_command_runs_from_the_wheel(wheel: Path, tmp_path: Path) -> None:
    run = (
        "import sys, mapquilt.__main__ as command; print(command.__file__); sys.argv = ['mapquilt', '--help']; "
        "command.main()"
    )
    environment = os.environ | {"PYTHONPATH": str(wheel)}
    done = subprocess.run(
        [sys.executable, "-c", run], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(str(wheel))
    for command in ("simulate", "merge", "score"):
        assert command in done.stdout


def locked() -> dict[str, str]:
    """Each requirement of the lock with the text that follows it."""
    text = (ROOT / "requirements.lock").read_text()
    entries = re.split(r"^(?=\S)", text, flags=re.MULTILINE)
    return {entry.split("==")[0]: entry for entry in entries if entry}


def test_every_locked_package_has_hashes() -> None:
    entries = locked()
    assert len(entries) > 50
    for name, entry in entries.items():
        assert re.match(r"[a-z0-9.-]+==\S+( ; [^\\]+)? \\\n    --hash=sha256:[0-9a-f]{64}", entry), name


def test_the_lock_names_no_address() -> None:
    text = (ROOT / "requirements.lock").read_text()
    assert not re.search(r"://|--(index|extra-index|find-links|trusted)|file:| @ ", text)


def test_every_dependency_is_locked() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = project["dependencies"] + project["optional-dependencies"]["dev"]
    names = {re.split(r"[<>=;\[ ]", requirement)[0].lower() for requirement in wanted}
    assert names <= set(locked())
