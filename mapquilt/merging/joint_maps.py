"""Maps of several logs whose poses are optimised together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.log_odds import map_log
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.sensor_model import sensor_model
from mapping.map_set import MapSet
from mapping.settings import MappingSettings
from mapping.slam.pipeline import slam_together
from mapping.slam.result import JointSlamResult
from mapquilt.logs.load_log import NamedLog
from mapquilt.logs.log_map import draw_logs
from merge.merger import merge_maps
from merge.settings import MergeSettings

Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class JointMaps:
    """Maps of logs by their names, each in the frame of its start.

    ``loops`` counts those between two robots whose poses were optimised together. A robot without any keeps the map of
    its own SLAM.
    """

    grids: Mapping[str, OccupancyGrid]
    loops: Mapping[Pair, int]


def draw_jointly(
    logs: Sequence[NamedLog],
    mapping: MappingSettings,
    settings: MergeSettings,
    seed: int = 0,
    on_progress: Callable[[int, int], None] = lambda _, __: None,
) -> JointMaps:
    """Map each log, merge the maps, optimise the poses of each group in one graph, and draw its maps anew.

    What two robots saw shows the drift of both (multi-session SLAM, as in McDonald et al. 2013). The merge tells
    roughly where they started; loops between them, which pass the same tests as those of one robot, tell the rest.
    ``settings`` are those of the merge. ``on_progress`` gets the number of logs done, counted twice, and their total.
    """
    total = 2 * len(logs)
    scans = sum(len(log.recorded.log.scans) for log in logs)
    alone = draw_logs(logs, mapping, lambda done, _: on_progress(done * len(logs) // scans, total))
    grids = {log.name: one.grid for log, one in zip(logs, alone, strict=True)}
    maps = MapSet(tuple(grids), tuple(grids.values()), tuple("m" for _ in logs))
    merged = merge_maps(maps, replace(settings, elastic=False), seed)
    loops: dict[Pair, int] = {}
    by_name = {log.name: log for log in logs}
    for group in merged.groups:
        robots = [(by_name[name], place) for name, place in group.reference_from_map.items()]
        for joined, joint in _optimised(robots, mapping):
            model = sensor_model(mapping.sensor_model)
            for log, poses in zip(joined, joint.trajectories, strict=True):
                drawn = map_log(log.recorded.log, poses.from_start(), mapping.resolution, model, mapping.clear_range)
                grids[log.name] = drawn
            names = [log.name for log in joined]
            counts = _loops(joint, len(joined))
            loops |= {(names[a], names[b]): count for (a, b), count in counts.items()}
    on_progress(total, total)
    return JointMaps(grids, loops)


def _optimised(
    robots: Sequence[tuple[NamedLog, Similarity2]], mapping: MappingSettings
) -> Iterator[tuple[list[NamedLog], JointSlamResult]]:
    """Yield the robots that loops link, and their poses; leave out those that no loop links to any other."""
    if len(robots) < 2:
        return
    to_first, logs = robots[0][1].inverse(), [log for log, _ in robots]
    starts = [to_first @ place for _, place in robots]
    odometry = mapping.slam.motion.odometry and all(log.recorded.has_odometry for log in logs)
    settings = replace(mapping.slam, motion=replace(mapping.slam.motion, odometry=odometry))
    joint = slam_together(
        [(log.recorded.log, SE2(start.x, start.y, start.yaw)) for log, start in zip(logs, starts, strict=True)],
        settings,
    )
    linked = _linked(_loops(joint, len(robots)))
    if len(linked) == len(robots):
        yield logs, joint
        return
    yield from _optimised([robots[k] for k in sorted(linked)], mapping)
    yield from _optimised([robot for k, robot in enumerate(robots) if k not in linked], mapping)


def _loops(joint: JointSlamResult, robots: int) -> dict[tuple[int, int], int]:
    """Count the loops between each two robots that have any."""
    pairs = [(a, b) for a in range(robots) for b in range(a + 1, robots)]
    counts = {pair: joint.loops_between(*pair) for pair in pairs}
    return {pair: count for pair, count in counts.items() if count}


def _linked(pairs: Mapping[tuple[int, int], int]) -> set[int]:
    """Return the first robot and those that loops link to it, over others too."""
    found, grown = {0}, True
    while grown:
        more = {robot for pair in pairs if found & set(pair) for robot in pair} - found
        found |= more
        grown = bool(more)
    return found
