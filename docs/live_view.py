"""Draw the terminal view of a live merge for the documentation.

python docs/live_view.py BAG SECONDS PICTURE.svg
"""

from __future__ import annotations

import re
import sys
from itertools import takewhile
from pathlib import Path

from rich.console import Console

from mapquilt.live.bag_maps import bag_maps
from mapquilt.live.live_merger import LiveMerger
from mapquilt.live.replay import replay
from mapquilt.live.terminal_view import MergeRate, overview

bag, seconds, picture = Path(sys.argv[1]), float(sys.argv[2]), Path(sys.argv[3])
merger, rate = LiveMerger(), MergeRate()
start = next(iter(bag_maps(bag)))[0]
for moment in replay(merger, takewhile(lambda each: each[0] <= start + seconds, bag_maps(bag))):
    rate.add(moment.seconds, moment.now)
    now = moment.now
console = Console(width=80, record=True, file=Path("/dev/null").open("w"), force_terminal=True, markup=False)  # noqa: SIM115
console.print(overview(merger.state, now, rate.text(now), frozen=False, settings=merger.settings))
svg = console.export_svg(title="mapquilt live --discover '/robot_*/map'")
picture.write_text(re.sub(r"@font-face \{.*?\}\s*", "", svg, flags=re.DOTALL).replace("Fira Code", "DejaVu Sans Mono"))
