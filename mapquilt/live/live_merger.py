"""The live merge of a team: maps in, in the order of their arrival; poses, a merged map and diagnostics out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.sparse.csgraph import shortest_path

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.live.pair_answers import Known, match_changed, match_new, without
from mapquilt.live.placement import Missing, Placement, Sighting, State, advance, anchor, restarted
from mapquilt.live.received_map import MapMessage, MapPatch
from mapquilt.live.robots import Robot, heard
from mapquilt.live.settings import LiveSettings
from merge.fusion import Fused, finest, fuse_and_compare
from merge.merger import cluster
from merge.multimap.graph import Cluster, adjacency
from merge.multimap.team import Team
from merge.pair.feature_cache import FeatureCache
from merge.records.result import PairResult
from merge.records.verdict import Reason
from merge.settings import MergeSettings

CONTRADICTING = (Reason.FREE_SPACE_VIOLATION, Reason.CONTRADICTS_TEAM, Reason.CONTRADICTS_PRIOR)
"""Refusals that speak against the pose that is held; others only no longer support it."""


@dataclass(frozen=True, eq=False)
class JoinedMaps:
    """Maps that are joined, each with its ``merged_from_map``, on the cells of a ``raster``; fused when asked for."""

    raster: GridFrame
    maps: tuple[tuple[Similarity2, OccupancyGrid], ...]
    settings: MergeSettings

    @cached_property
    def fused(self) -> Fused:
        """Return the merged map and its conflicts."""
        return fuse_and_compare(self.raster, self.maps, self.settings.fusion, self.settings.merged_grid)


@dataclass(frozen=True, eq=False)
class LiveState:
    """All that a live merge knows at one moment.

    ``robots`` in the order in which they were first heard, their ``placements``, the answers of their ``pairs``, the
    ``raster`` of the merged map, None before the first join, the maps that are ``joined``; ``turn`` counts the updates,
    ``events`` tell what the last one changed.
    """

    robots: Mapping[str, Robot] = field(default_factory=dict)
    placements: Mapping[str, Placement] = field(default_factory=dict)
    pairs: Known = field(default_factory=dict)
    raster: GridFrame | None = None
    joined: JoinedMaps | None = None
    turn: int = 0
    events: tuple[str, ...] = ()

    @property
    def poses(self) -> dict[str, Similarity2]:
        """Poses ``merged_from_map`` of the maps that are joined."""
        poses = {name: placement.published for name, placement in self.placements.items()}
        return {name: pose for name, pose in poses.items() if pose is not None}

    @property
    def fused(self) -> Fused | None:
        """Merged map and conflicts, made when they are first asked for; None before the first join."""
        return None if self.joined is None else self.joined.fused


class LiveMerger:
    """Merge the maps of running robots. Each update returns a new ``LiveState``; the old one does not change.

    The merged frame is that of the first map of the first join, and stays where it is as long as two maps are joined.
    While ``frozen``, maps are received and fused, but no pose changes and no map joins or leaves.
    """

    def __init__(self, settings: LiveSettings = LiveSettings(), frozen: bool = False) -> None:
        self.settings, self.frozen, self.state = settings, frozen, LiveState()
        self._cache = FeatureCache(settings.merge.preparation)
        self._last_step = math.inf

    def update(self, messages: Iterable[MapMessage | MapPatch], now: float) -> LiveState:
        """Take messages that have come until ``now`` [s], match what they changed, and return the new state.

        Once no map has changed for long, the answers count as confirmed, for maps that have not joined yet.
        """
        before, robots = self.state, dict(self.state.robots)
        for message in messages:
            name = message.robot
            robots[name] = heard(robots.get(name, Robot(name)), message, now, self.settings)
        reborn = [name for name, robot in before.robots.items() if robots[name].life != robot.life]
        placements = {name: before.placements.get(name, Placement()) for name in robots}
        pairs = before.pairs
        for name in reborn:
            pairs = without(pairs, name)
            placements[name] = restarted(robots[name].notes[0])
        placements = _with_reference(placements)
        state = replace(
            before,
            robots=robots,
            placements=placements,
            pairs=pairs,
            turn=before.turn + 1,
            events=_heard(before, robots),
        )
        changed = [
            name for name in robots if name not in before.robots or robots[name].version != _version(before, name)
        ]
        still = not changed and self.is_still(now)
        if changed or still:
            self._last_step = now
            state = state if self.frozen else self._placed(state, still)
            state = self._joined(state)
        self.state = replace(state, events=(*state.events, *_moved(before, state)))
        return self.state

    def is_still(self, now: float) -> bool:
        """Check if no map has changed for long, or since the last step without any change."""
        return not self.frozen and now - self._last_step >= self.settings.still_after

    def catch_up(self) -> bool:
        """Match a pair that never was, for a time at which no map comes; return False if there is none.

        No map joins or moves by that: it takes new cells, or time, to confirm an answer.
        """
        usable = [robot for robot in self.state.robots.values() if robot.grid is not None]
        pairs = (
            None if self.frozen else match_new(usable, self.state.pairs, self._cache, self.state.turn, self.settings)
        )
        if pairs is not None:
            self.state = replace(self.state, pairs=pairs)
        return pairs is not None

    def _placed(self, state: LiveState, still: bool) -> LiveState:
        """Match the pairs that changed, and advance the placement of each map that they concern.

        If the maps stand ``still``, advance that of each map that is not joined.
        """
        held = {name: each.held for name, each in state.placements.items() if each.is_joined and each.held is not None}
        usable = [robot for robot in state.robots.values() if robot.grid is not None]
        self._cache.keep(robot.grid for robot in usable if robot.grid is not None)
        pairs = match_changed(usable, state.pairs, held, self._cache, state.turn, self.settings)
        state = replace(state, pairs=pairs)
        if len(usable) < 2:
            return state
        team = _team(usable, self._cache, self.settings)
        answers = {team.pair(*names): entry.answer for names, entry in pairs.items()}
        clusters = [_Cluster(team, each, answers) for each in cluster(team, answers) if len(each.poses) > 1]
        state = (
            state
            if sum(each.is_joined for each in state.placements.values()) > 1
            else self._with_frame(state, clusters)
        )
        concerned = {name for names, entry in pairs.items() if entry.turn == state.turn for name in names}
        if still:
            concerned = {name for name, each in state.placements.items() if not each.is_joined}
        placements = dict(state.placements)
        seen = _sightings(state, clusters)
        for robot in usable:
            name = robot.name
            if name in concerned and name != _reference(state):
                found = seen.get(name) or _missing(name, state)
                placements[name] = advance(placements[name], found, robot.middle, self.settings.placement)
        return replace(state, placements=placements)

    def _with_frame(self, state: LiveState, clusters: Sequence[_Cluster]) -> LiveState:
        """Fix the merged frame: that of the map that is joined already, else of the first map of the surest pair."""
        joined = [name for name, each in state.placements.items() if each.is_joined]
        sure = [each for each in clusters if each.surest >= self.settings.placement.join_confidence]
        if not sure or any(name in each.names for name in joined for each in sure):
            return state
        first = max(sure, key=lambda each: (len(each.names), each.surest)).names[0]
        grid = state.robots[first].grid
        if grid is None:
            return state
        placements = {name: Placement() if name in joined else each for name, each in state.placements.items()}
        finest_cell = min(robot.grid.frame.resolution for robot in state.robots.values() if robot.grid is not None)
        return replace(
            state,
            placements={**placements, first: anchor(Similarity2.identity())},
            raster=finest(grid.frame, [finest_cell]),
            events=(*state.events, f"{first}: the merged frame is its map frame"),
        )

    def _joined(self, state: LiveState) -> LiveState:
        """Put the maps that are joined on the cells of the raster that was fixed."""
        if state.raster is None:
            return state
        maps = [(pose, grid) for name, pose in state.poses.items() if (grid := state.robots[name].grid) is not None]
        joined = JoinedMaps(state.raster, tuple(maps), self.settings.merge) if maps else None
        return replace(state, joined=joined)


def _version(state: LiveState, name: str) -> int:
    return state.robots[name].version


def _team(robots: Sequence[Robot], cache: FeatureCache, settings: LiveSettings) -> Team:
    grids = tuple(robot.grid for robot in robots if robot.grid is not None)
    names = tuple(robot.name for robot in robots)
    return Team.of(MapSet(names, grids, tuple("m" for _ in names)), settings.merge, settings.seed, cache=cache)


class _Cluster:
    """A cluster with names: ``names`` in the order in which the robots were heard, and its ``surest`` pair."""

    def __init__(self, team: Team, found: Cluster, answers: Mapping[tuple[int, int], PairResult]) -> None:
        self._team, self._cluster = team, found
        self.names = tuple(name for name in team.names if team.index(name) in found.poses)
        self._chains = team.chain_confidences(found, answers)
        self.surest = max(self._chains.values())

    def sighting(self, held: Sighting, reference: str, name: str) -> Sighting:
        """Return the pose of a map, if that of the reference is ``held``."""
        a, b = self._team.index(reference), self._team.index(name)
        merged_from_map = held.merged_from_map @ self._team.metric(self._cluster, reference, name)
        cell = self._team.frames[a].metres_from_local.scale
        sigma, yaw_sigma = self._sigmas(a, b)
        confidence = self._chains[min(a, b), max(a, b)]
        return Sighting(replace(merged_from_map, scale=1.0), cell * sigma, yaw_sigma, confidence)

    def _sigmas(self, first: int, second: int) -> tuple[float, float]:
        """Return the standard deviations of shift [cells] and yaw [rad] along the best chain between two maps."""
        members, edges = sorted(self._cluster.poses), self._cluster.edges
        at = members.index(first), members.index(second)
        costs = (
            [float(np.linalg.eigvalsh(edge.covariance[:2, :2]).max()) for edge in edges],
            [float(edge.covariance[2, 2]) for edge in edges],
        )
        sums = [shortest_path(adjacency(members, edges, each), directed=False, indices=at[0])[at[1]] for each in costs]
        return float(np.sqrt(sums[0])), float(np.sqrt(sums[1]))


def _reference(state: LiveState) -> str | None:
    """Return the map that holds the merged frame, from whose pose all others are measured; None before a join."""
    return next((name for name, each in state.placements.items() if each.holds_frame), None)


def _with_reference(placements: Mapping[str, Placement]) -> dict[str, Placement]:
    """Let the surest joined map hold the merged frame if the one that held it has left or restarted."""
    joined = {name: each.held for name, each in placements.items() if each.is_joined and each.held is not None}
    if not joined or any(each.holds_frame for each in placements.values()):
        return dict(placements)
    surest = min(joined, key=lambda name: joined[name].sigma)
    return {**placements, surest: anchor(joined[surest].merged_from_map)}


def _sightings(state: LiveState, clusters: Sequence[_Cluster]) -> dict[str, Sighting]:
    """Return the pose of each map that a cluster joins to the merged frame, measured from the reference map."""
    reference = _reference(state)
    held = None if reference is None else state.placements[reference].held
    for each in clusters:
        if reference in each.names and reference is not None and held is not None:
            return {name: each.sighting(held, reference, name) for name in each.names if name != reference}
    return {}


def _missing(name: str, state: LiveState) -> Missing:
    """Explain why no chain of accepted pairs leads from a map to the merged frame, by its surest pair."""
    entries = {names: entry.answer for names, entry in state.pairs.items() if name in names}
    answers = list(entries.values())
    if not answers:
        return Missing("no pair of it was matched yet")
    surest = max(answers, key=lambda answer: (answer.accepted, answer.confidence))
    other = surest.source if surest.target == name else surest.target
    if surest.accepted:
        in_frame = state.placements[other].is_joined
        if in_frame:
            return Missing(f"with {other}: contradicts the rest of the team", contradicted=True)
        return Missing(f"with {other}: joined, but not with the merged map")
    held = [state.pairs[names] for names in entries if all(state.placements[each].is_joined for each in names)]
    contradicted = any(each.challenged or each.answer.reason in CONTRADICTING for each in held)
    return Missing(f"with {other}: {surest.reason_text}", contradicted)


def _heard(before: LiveState, robots: Mapping[str, Robot]) -> tuple[str, ...]:
    """Tell new robots, faults and notes."""
    events = []
    for name, robot in robots.items():
        old = before.robots.get(name)
        if old is None:
            events.append(f"{name}: heard for the first time")
        if robot.fault and (old is None or robot.fault != old.fault):
            events.append(f"{name}: {robot.fault}; the message is ignored")
        if robot is not old:
            events += [f"{name}: {note}" for note in robot.notes]
    return tuple(events)


def _moved(before: LiveState, state: LiveState) -> tuple[str, ...]:
    """Tell the maps that joined or left."""
    events = []
    for name, now in state.placements.items():
        old = before.placements.get(name, Placement())
        if now.state is State.SUSPECT and old.state is not State.SUSPECT:
            events.append(f"{name}: doubtful: {now.reason}")
        if now.is_joined != old.is_joined:
            robot, last = state.robots[name], before.robots.get(name)
            reason = robot.notes[0] if last is not None and robot.life != last.life else now.reason
            events.append(f"{name}: joined" if now.is_joined else f"{name}: left: {reason}")
    return tuple(events)
