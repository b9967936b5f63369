"""Latency and memory of a live merge: ``python -m benchmarks.live_latency [latency | memory]``.

``latency``: time from a map's arrival to the merged map, of four robots in an office of 40 m x 40 m, whose maps have
800 x 800 cells in the end, after they have joined. ``memory``: resident memory by the minute over an hour of mission
time, in which a team explores a house, is switched off and starts again. Without a part: both.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from benchmarks.live_team import MissionPlan, simulate_team
from mapquilt.cli.tables import print_table
from mapquilt.live.live_merger import LiveMerger
from mapquilt.live.received_map import MapMessage
from mapquilt.viz.text_table import plain_table

OFFICE = MissionPlan(5, "office", 4, 420.0, "close", 1.0, 0.0, (40.0, 40.0))
HOUSE = MissionPlan(3, "house", 2, 80.0, "close", 1.0, 0.0)
PERIOD = 5.0
FIRST_HEARD, FIRST_MEASURED = 300.0, 340.0
HOUR, MINUTE = 3600.0, 60.0


def main(arguments: list[str]) -> None:
    """Run the named part, or both."""
    parts = {"latency": bench_latency, "memory": bench_memory}
    for name in arguments or parts:
        parts[name]()


def bench_latency() -> None:
    """Print the time of each update with large maps: of the process and of the clock."""
    team = simulate_team(OFFICE, PERIOD)
    merger, seconds, clock = LiveMerger(), list[float](), list[float]()
    for now, message in team.messages:
        if now < FIRST_HEARD:
            continue
        processor, wall = time.process_time(), time.perf_counter()
        fused = merger.update([message], now).fused
        merged = None if fused is None else fused.merged.occupancy()
        if now >= FIRST_MEASURED and merged is not None:
            seconds.append(time.process_time() - processor)
            clock.append(time.perf_counter() - wall)
    last = {message.robot: message for _, message in team.messages}
    sizes = ", ".join(f"{each.width} x {each.height}" for each in last.values())
    table = plain_table(("time", False), ("median s", True), ("p90 s", True), ("max s", True), ("asked", True))
    for name, values in (("processor", seconds), ("wall clock", clock)):
        p90 = statistics.quantiles(values, n=10)[-1]
        table.add_row(name, *(f"{each:.2f}" for each in (statistics.median(values), p90, max(values))), "1.0")
    table.caption = (
        f"{len(seconds)} maps of {len(merger.state.robots)} robots, {len(merger.state.poses)} joined; last maps {sizes}"
    )
    print_table(table)


def bench_memory() -> None:
    """Print resident memory by the minute."""
    merger, due = LiveMerger(), 0.0
    table = plain_table(("minute", True), ("MB", True), ("joined", True), ("restarts", True))
    for now, message in _looped():
        fused = merger.update([message], now).fused
        joined = 0 if fused is None else len(merger.state.poses)
        if now >= due:
            due += MINUTE
            restarts = sum(robot.life for robot in merger.state.robots.values())
            table.add_row(f"{now / MINUTE:.0f}", f"{resident_mb():.0f}", str(joined), str(restarts))
    print_table(table)


def _looped() -> Iterator[tuple[float, MapMessage]]:
    """Repeat a mission for an hour; at each start the maps are small and their frames new."""
    team = simulate_team(HOUSE, PERIOD)
    start = 0.0
    while start < HOUR:
        for now, message in team.messages:
            yield start + now, replace(message, stamp=start + message.stamp, frame=f"{message.frame}_{start:.0f}")
        start += HOUSE.duration + PERIOD


def resident_mb() -> float:
    """Return the resident memory of this process [MB], by proc(5)."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024.0 for line in lines if line.startswith("VmRSS:"))


if __name__ == "__main__":
    main(sys.argv[1:])
