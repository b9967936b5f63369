"""The files of a folder change together or not at all, whatever step the writer is killed at."""

from __future__ import annotations

import errno
import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from mapping.io.atomic import remove_temporaries, temporary_folder
from mapping.io.transaction import (
    COMMIT,
    LEDGER_FILE,
    added_files,
    atomic_folder,
    change_files,
    finish_transaction,
    written_files,
)

ROOT = Path(__file__).parents[3]

WRITERS = {
    "files": """
files = {folder / name: b"new" for name in ("a", "b", "sub/c", "sub/deep/d")}
change_files(folder, files, ("e", "gone/f"), ledger=True)
""",
    "folder": """
with atomic_folder(folder, ledger=True) as aside:
    (aside / "sub/deep").mkdir(parents=True)
    for name in ("a", "b", "sub/c", "sub/deep/d"):
        (aside / name).write_bytes(b"new")
""",
}

KILLED = """
import os, signal, sys
from pathlib import Path
from mapping.io.transaction import atomic_folder, change_files

folder, last, steps = Path(sys.argv[1]), int(sys.argv[2]), 0
EVENTS = {"os.rename", "os.remove", "os.rmdir", "os.mkdir", "open"}

def step(event, arguments):
    global steps
    if event in EVENTS and str(arguments[0]).startswith(str(folder.parent)):
        steps += 1
        if steps == last:
            os.kill(os.getpid(), signal.SIGKILL)

sys.addaudithook(step)
"""
OLD = {"a": "old", "e": "old", "gone/f": "old", "notes": "mine"}
NEW = {"a": "new", "b": "new", "sub/c": "new", "sub/deep/d": "new", "notes": "mine"}


def content(folder: Path, hidden: bool = False) -> dict[str, str]:
    files = (path for path in folder.rglob("*") if path.is_file())
    found = {path.relative_to(folder).as_posix(): path.read_text() for path in files}
    return {name: text for name, text in found.items() if hidden or not name.startswith(".")}


def make_old(folder: Path) -> None:
    with atomic_folder(folder, ledger=True) as aside:
        (aside / "gone").mkdir()
        for name in ("a", "e", "gone/f"):
            (aside / name).write_text("old")
    (folder / "notes").write_text("mine")


@pytest.mark.slow
@pytest.mark.parametrize("writer", WRITERS)
def test_a_kill_at_any_step_leaves_all_old_or_all_new(tmp_path: Path, writer: str) -> None:
    seen = []
    for last in range(1, 200):
        folder = tmp_path / f"{last}" / "run"
        make_old(folder)
        text = KILLED + WRITERS[writer]
        done = subprocess.run([sys.executable, "-c", text, str(folder), str(last)], cwd=ROOT, capture_output=True)
        assert done.returncode in (0, -signal.SIGKILL), done.stderr.decode()
        finish_transaction(folder)
        remove_temporaries(folder)
        found = content(folder)
        assert found in (OLD, NEW)
        assert set(content(folder, hidden=True)) == {*found, LEDGER_FILE}
        assert written_files(folder) == found.keys() - {"notes"}
        seen.append(found == NEW)
        if done.returncode == 0:
            break
    assert seen == sorted(seen) and not seen[0] and seen[-1]
    assert sum(seen) > 8  # kills between the renames
    assert sum(not one for one in seen) > 8  # and before the first of them


def test_added_files_join_the_list_and_replace_their_like(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    make_old(folder)
    with added_files(folder) as aside:
        (aside / "sub").mkdir()
        for name in ("a", "sub/c"):
            (aside / name).write_text("new")
    assert content(folder) == {**OLD, "a": "new", "sub/c": "new"}
    assert written_files(folder) == content(folder).keys() - {"notes"}


def test_a_full_disk_names_the_folder_and_adds_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    make_old(folder)
    with pytest.raises(OSError, match="No space left") as caught, added_files(folder) as aside:
        (aside / "a").write_text("new")
        raise OSError(errno.ENOSPC, "No space left on device")
    assert caught.value.filename == str(folder)
    assert content(folder) == OLD


def test_a_new_folder_appears_whole(tmp_path: Path) -> None:
    text = KILLED + WRITERS["folder"]
    for last in range(1, 100):
        folder = tmp_path / f"{last}" / "run"
        folder.parent.mkdir()
        done = subprocess.run([sys.executable, "-c", text, str(folder), str(last)], cwd=ROOT, capture_output=True)
        assert not folder.exists() or content(folder) == {k: v for k, v in NEW.items() if k != "notes"}
        with atomic_folder(folder) as aside:
            (aside / "a").write_text("next")
        assert {path.name for path in folder.parent.iterdir()} == {"run"}
        if done.returncode == 0:
            return
    raise AssertionError("never finished")


def test_the_files_of_a_living_writer_stay(tmp_path: Path) -> None:
    with temporary_folder(tmp_path / "run") as aside:
        remove_temporaries(tmp_path)
        assert aside.is_dir()
    assert not aside.exists()


@pytest.mark.parametrize("name", ["../victim", "/etc/victim", "link/victim", "sub/../../victim", COMMIT + "/x"])
def test_a_journal_of_a_stranger_reaches_nothing_outside(tmp_path: Path, name: str) -> None:
    (tmp_path / "victim").write_text("theirs")
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside/victim").write_text("theirs")
    folder = tmp_path / "run"
    (folder / COMMIT / "files").mkdir(parents=True)
    (folder / "link").symlink_to(tmp_path / "outside")
    (folder / COMMIT / "lock").touch()
    for journal in ({"write": [name], "delete": []}, {"write": [], "delete": [name]}):
        if not (folder / COMMIT).exists():
            continue
        (folder / COMMIT / "journal.json").write_text(json.dumps(journal))
        try:
            finish_transaction(folder)
        except ValueError as error:
            assert str(folder) in str(error)
    assert (tmp_path / "victim").read_text() == (tmp_path / "outside/victim").read_text() == "theirs"


@pytest.mark.parametrize("journal", ["", "null", "[]", '{"write": 3, "delete": []}', '{"write": [3], "delete": []}'])
def test_a_damaged_journal_is_named(tmp_path: Path, journal: str) -> None:
    (tmp_path / COMMIT).mkdir()
    (tmp_path / COMMIT / "lock").touch()
    (tmp_path / COMMIT / "journal.json").write_text(journal)
    with pytest.raises(ValueError, match=r"journal\.json"):
        finish_transaction(tmp_path)


def test_everything_that_could_stop_halfway_is_refused_before(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    make_old(folder)
    before = content(folder, hidden=True)
    (folder / "b").mkdir()
    with pytest.raises(FileExistsError, match="b: exists and is not a regular file"):
        change_files(folder, {folder / "a": b"new", folder / "b": b"new"}, ("e",), ledger=True)
    with pytest.raises(NotADirectoryError, match="a: is not a folder"):
        change_files(folder, {folder / "e": b"new", folder / "a/x": b"new"}, (), ledger=True)
    assert content(folder, hidden=True) == before
    assert not any((folder / "b").iterdir())
