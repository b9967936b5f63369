import subprocess
import sys
import time

import numpy as np

from benchmarks.team_injection.usage import usage

MEGABYTES = 60
HOLD = f"""
import time
held = bytearray({MEGABYTES}_000_000)
for k in range(0, len(held), 4096):
    held[k] = 1
time.sleep(1)
"""


def test_the_peak_is_of_all_processes_at_one_time():
    with usage() as idle:
        time.sleep(0.15)
    with usage() as used:
        mine = np.ones(MEGABYTES * 125_000)
        subprocess.run([sys.executable, "-c", HOLD], check=True)
        del mine
    assert 0.9 * MEGABYTES < used.own - idle.own < 1.5 * MEGABYTES
    assert used.largest_worker > 0.9 * MEGABYTES
    assert used.whole > idle.own + 1.8 * MEGABYTES


def test_processor_time_is_that_of_the_block_and_of_its_children():
    spin = "import time\nwhile time.process_time() < 0.6: pass"
    with usage() as used:
        subprocess.run([sys.executable, "-c", spin], check=True)
    assert 0.3 < used.seconds < 3.0
