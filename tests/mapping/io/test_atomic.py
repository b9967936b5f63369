"""Files and folders are written completely or not at all."""

from __future__ import annotations

import fcntl
import os
import resource
import signal
import stat
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from mapping.io.atomic import write_bytes_atomically
from mapping.io.transaction import atomic_folder, write_files_atomically

ROOT = Path(__file__).parents[3]

WRITE_BOTH = """
import pathlib, signal, sys
from mapping.io.transaction import write_files_atomically
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
folder = pathlib.Path(sys.argv[1])
write_files_atomically({folder / "a": b"new", folder / "b": bytes(2000)})
"""


class HalfwayError(RuntimeError):
    """An error that stops a writer halfway."""


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def visible(folder: Path) -> set[str]:
    return {name for name in names(folder) if not name.startswith(".")}


def test_a_file_is_written_and_replaced(tmp_path: Path) -> None:
    for data in (b"first", b"second"):
        write_bytes_atomically(tmp_path / "file", data)
        assert (tmp_path / "file").read_bytes() == data
    assert names(tmp_path) == {"file"}


def test_what_a_killed_writer_left_is_removed_and_a_living_one_and_others_stay(tmp_path: Path) -> None:
    dead, living, other = (
        tmp_path / f".{name}.{digit * 16}.part" for name, digit in (("a.json", "0"), ("a.json", "1"), ("b.json", "2"))
    )
    dead.write_bytes(b"half")
    other.write_bytes(b"half")
    with living.open("xb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        write_bytes_atomically(tmp_path / "a.json", b"whole")
        assert names(tmp_path) == {"a.json", living.name, other.name}


def test_a_file_has_the_usual_rights(tmp_path: Path) -> None:
    (tmp_path / "usual").write_bytes(b"")
    write_bytes_atomically(tmp_path / "file", b"")
    with atomic_folder(tmp_path / "folder"):
        pass
    (tmp_path / "usual folder").mkdir()
    rights = {name: stat.S_IMODE((tmp_path / name).stat().st_mode) for name in names(tmp_path)}
    assert rights["file"] == rights["usual"]
    assert rights["folder"] == rights["usual folder"]


def test_a_file_that_cannot_be_renamed_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    with pytest.raises(OSError, match="taken"):
        write_bytes_atomically(tmp_path / "taken", b"data")
    assert names(tmp_path) == {"taken"}


def test_the_target_of_a_link_is_written(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "disk/there").write_bytes(b"old")
    for name in ("there", "new"):
        (tmp_path / name).symlink_to(f"disk/{name}")
        write_bytes_atomically(tmp_path / name, b"data")
        assert (tmp_path / name).is_symlink()
        assert (tmp_path / "disk" / name).read_bytes() == b"data"
    assert names(tmp_path / "disk") == {"there", "new"}


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir, lambda path: path.symlink_to("/dev/null")])
def test_only_regular_files_are_replaced(tmp_path: Path, make: Callable[[Path], None]) -> None:
    make(tmp_path / "special")
    before = (tmp_path / "special").lstat()
    with pytest.raises(FileExistsError, match="special: exists and is not a regular file"):
        write_files_atomically({tmp_path / "usual": b"data", tmp_path / "special": b"data"})
    assert (tmp_path / "special").lstat() == before
    assert names(tmp_path) == {"special"}


def test_a_cycle_of_links_is_refused(tmp_path: Path) -> None:
    (tmp_path / "ring").symlink_to("ring")
    with pytest.raises(OSError, match="ring"):
        write_bytes_atomically(tmp_path / "ring", b"data")
    assert names(tmp_path) == {"ring"}


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"/no: no such folder$"):
        write_bytes_atomically(tmp_path / "no/file", b"data")


def test_no_file_is_written_if_one_fails(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"old")
    limit = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)); {WRITE_BOTH}"
    done = subprocess.run([sys.executable, "-c", limit, str(tmp_path)], cwd=ROOT, capture_output=True, text=True)
    assert "File too large" in done.stderr
    assert names(tmp_path) == {"a"}
    assert (tmp_path / "a").read_bytes() == b"old"


@contextmanager
def full_disk(most_bytes: int = 1000) -> Iterator[None]:
    """No file may grow beyond so many bytes: what a full disk does, for this process alone."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_full_disk_names_the_file(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="too large") as caught, full_disk():
        write_bytes_atomically(tmp_path / "file", bytes(2000))
    assert caught.value.filename == str(tmp_path / "file")
    with pytest.raises(OSError, match="too large") as caught, full_disk(), atomic_folder(tmp_path / "run") as aside:
        (aside / "robot").mkdir()
        write_bytes_atomically(aside / "robot/file", bytes(2000))
    assert caught.value.filename == str(tmp_path / "run/robot/file")
    assert names(tmp_path) == set()


def test_a_folder_appears_at_the_end_only(tmp_path: Path) -> None:
    final = tmp_path / "a" / "b" / "run"
    with atomic_folder(final) as aside:
        (aside / "file").write_text("new")
        assert not final.exists()
    assert (final / "file").read_text() == "new"
    assert names(final.parent) == {"run"}


def test_a_folder_that_was_written_is_replaced_whole(tmp_path: Path) -> None:
    final = tmp_path / "run"
    with atomic_folder(final, ledger=True) as aside:
        (aside / "old").write_text("old")
    with atomic_folder(final) as aside:
        (aside / "new").write_text("new")
        assert visible(final) == {"old"}
    assert names(final) == {"new"}
    assert names(tmp_path) == {"run"}


@pytest.mark.parametrize("existed", [True, False])
def test_a_block_that_fails_changes_nothing(tmp_path: Path, existed: bool) -> None:
    final = tmp_path / "run"
    if existed:
        final.mkdir()
        (final / "old").write_text("old")
    with pytest.raises(HalfwayError), atomic_folder(final) as aside:
        (aside / "new").write_text("half")
        raise HalfwayError
    assert names(tmp_path) == ({"run"} if existed else set())
    if existed:
        assert names(final) == {"old"}


def test_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "run").symlink_to(tmp_path / "disk")
    with atomic_folder(tmp_path / "run") as aside:
        (aside / "new").write_text("new")
    assert (tmp_path / "run").is_symlink()
    assert names(tmp_path / "disk") == {"new"}


def test_a_file_is_never_replaced_by_a_folder(tmp_path: Path) -> None:
    (tmp_path / "run").write_text("a report")
    with pytest.raises(NotADirectoryError, match="run is a file"), atomic_folder(tmp_path / "run"):
        pass
    assert (tmp_path / "run").read_text() == "a report"


def test_a_killed_writer_leaves_the_old_folder_and_can_be_started_again(tmp_path: Path) -> None:
    final = tmp_path / "run"
    final.mkdir()
    (final / "old").write_text("old")
    writer = (
        "import sys, pathlib, time; from mapping.io.transaction import atomic_folder\n"
        "with atomic_folder(pathlib.Path(sys.argv[1])) as aside:\n"
        "    (aside / 'half').write_text('half'); print('ready', flush=True); time.sleep(60)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", writer, str(final)], cwd=ROOT, stdout=subprocess.PIPE, env=dict(os.environ)
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b"ready\n"
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert visible(final) == {"old"}
    with atomic_folder(final, stale=("old",)) as aside:
        (aside / "new").write_text("new")
    assert names(final) == {"new"}
