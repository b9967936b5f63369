"""Progress is shown on a terminal only, and to the end."""

import os
import pty
import re
import subprocess
import sys

from mapquilt.runs.stages import sense_run
from mapquilt.settings import SampleSettings


def on_terminal(*arguments):
    """What a command says on standard error where that is a terminal."""
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "mapquilt", *map(str, arguments)]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "120"}
    with subprocess.Popen(command, stderr=theirs, stdout=subprocess.DEVNULL, env=environment) as process:
        os.close(theirs)
        said = b""
        while piece := _read(ours):
            said += piece
    os.close(ours)
    assert process.returncode == 0
    return re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", said.decode())


def _read(terminal):
    try:
        return os.read(terminal, 65536)
    except OSError:  # what Linux says where the other end is closed
        return b""


def test_progress_of_simulate_and_sense_is_shown_to_the_end(tmp_path):
    place = ("office", "--robots", 1, "--duration", 1, "--seed", 3, "--out", tmp_path / "run")
    said = on_terminal("simulate", *place)
    assert re.search(r"simulating .* 1/1 s", said)
    assert re.search(r"mapping .* 3/3 steps", said)
    assert re.search(r"mapping .* 6/6", on_terminal("sense", tmp_path / "run", "--parts", 2, "--out", tmp_path / "two"))


def test_steps_are_reported_one_by_one(merged_run, tmp_path):
    reported = []
    sense_run(merged_run, tmp_path / "again", SampleSettings(), lambda done, total: reported.append((done, total)))
    assert reported == [(done, 6) for done in range(7)]
