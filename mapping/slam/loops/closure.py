"""Keyframe graph that grows with the track: search loops, solve, and drop loops that the others contradict."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mapping.slam.graph.pose_graph import chi_squared, optimise_poses, relative_covariances
from mapping.slam.linear_algebra import transformed
from mapping.slam.link import Link, LinkTable
from mapping.slam.loops.registration import Candidate, Loop, SubMap, register, sub_map
from mapping.slam.planar import between, compose, rotation
from mapping.slam.settings import SlamSettings
from mapping.slam.tracking.points import ScanPoints
from mapping.slam.tracking.tracker import Tracker

KEPT_SCANS = 200
"""Number of keyframes whose points are kept; those of others are computed anew."""


class KeyframeGraph:
    """Keyframe ``poses`` (K, 3) in the frame of the first, corrected by the ``loops`` found so far."""

    def __init__(self, tracker: Tracker, settings: SlamSettings) -> None:
        self.tracker = tracker
        self.settings = settings
        self.poses = np.zeros((0, 3))
        self.loops: list[Loop] = []
        self._first = 0
        self._since_search = 0.0
        self._unsolved = 0
        self._distances = np.zeros(0)
        self._track_links = LinkTable.of(())
        self._points = lru_cache(maxsize=KEPT_SCANS)(self._points_of)

    def links(self) -> list[Link]:
        """Return the links of the track and those of the loops."""
        return [*self.tracker.track.links, *(loop.link for loop in self.loops)]

    def begin(self, scan: int, pose: NDArray[np.float64]) -> None:
        """Start the next log, whose first scan is ``scan``, at a pose (3,) in the frame of the first keyframe."""
        self.solve()
        self.tracker.begin(scan, between(self.poses[-1], pose))
        self.poses = np.vstack((self.poses, pose))
        self._since_search = 0.0
        self._first = len(self.poses) - 1

    def add_keyframe(self) -> None:
        """Take in the latest keyframe, and search loops if the robot drove far enough since the last search."""
        keyframes = self.tracker.track.keyframes
        pose = keyframes[-1].pose
        if len(keyframes) > 1:
            pose = compose(self.poses[-1], between(keyframes[-2].pose, pose))
        self.poses = np.vstack((self.poses, pose))
        self._since_search += keyframes[-1].path
        settings = self.settings.loops
        if settings.enabled and self._since_search >= settings.every and len(keyframes) - self._first > settings.fewest:
            self._since_search = 0.0
            self._search()

    def solve(self) -> None:
        """Optimise the poses; drop the loops that the others contradict, and optimise again."""
        settings = self.settings.loops
        self._unsolved = 0
        if not self.loops:
            return
        self.poses = optimise_poses(self.poses, self.links(), settings.iterations, settings.robust_deviations)
        chi = chi_squared(self.poses, [loop.link for loop in self.loops])
        kept = [loop for loop, value in zip(self.loops, chi, strict=True) if value <= settings.greatest_chi_squared]
        if len(kept) < len(self.loops):
            self.loops = kept
            self.poses = optimise_poses(self.poses, self.links(), settings.iterations, settings.robust_deviations)

    def _search(self) -> None:
        self._distances = self.tracker.track.distances()
        for candidate in self._candidates(len(self.poses) - 1):
            loop = self._register(candidate)
            if loop is not None and loop.refused is None:
                self.loops.append(loop)
                self._unsolved += 1
        settings = self.settings.loops
        if self._unsolved >= max(settings.solve_every, settings.solve_growth * len(self.loops)):
            self.solve()

    def _candidates(self, latest: int) -> list[Candidate]:
        """Return keyframes that lie near the latest one, but long ago on its path; nearest first."""
        settings = self.settings.loops
        old = np.flatnonzero(self._distances[latest] - self._distances > settings.least_way)
        if not old.size:
            return []
        apart = np.hypot(*(self.poses[old, :2] - self.poses[latest, :2]).T)
        if apart.min() > settings.shift[1] + settings.nearby:
            return []
        self._track_links = self._track_links.followed_by(self.tracker.track.links[len(self._track_links.ends) :])
        links = self._track_links.followed_by([loop.link for loop in self.loops])
        covariances = relative_covariances(links, latest, self.poses)[old]
        deviation = np.sqrt(np.maximum(covariances[:, 0, 0], covariances[:, 1, 1]))
        reach = np.minimum(settings.deviations * deviation, settings.shift[1]) + settings.nearby
        chosen: list[Candidate] = []
        for index in np.argsort(apart, kind="stable").tolist():
            frame = int(old[index])
            if apart[index] > reach[index] or any(abs(frame - one.first) <= settings.keyframes for one in chosen):
                continue
            turn = rotation(-self.poses[frame, 2])
            relative = between(self.poses[frame], self.poses[latest])
            chosen.append(Candidate(frame, latest, relative, transformed(turn, covariances[index])))
            if len(chosen) == settings.candidates:
                break
        return chosen

    def _register(self, candidate: Candidate) -> Loop | None:
        query = self._around(candidate.second, range(self._first, candidate.second + 1))
        target = self._around(candidate.first, self._session_of(candidate.first, query.start))
        return register(
            self._sub_map(query, candidate.second),
            self._sub_map(target, candidate.first),
            candidate,
            self.tracker.voxel,
            self.tracker.noise.level,
            self.settings,
        )

    def _sub_map(self, frames: range, middle: int) -> SubMap:
        tracker = self.tracker
        mount = tracker.logs[tracker.session_of(tracker.track.keyframes[middle].scan)].base_from_lidar
        return sub_map(frames, middle, self._pose_of, self._points, np.array([mount.x, mount.y, mount.yaw]))

    def _session_of(self, keyframe: int, stop: int) -> range:
        """Return the keyframes before ``stop`` of the log that a keyframe belongs to."""
        tracker = self.tracker
        session = tracker.session_of(tracker.track.keyframes[keyframe].scan)
        scans = [each.scan for each in tracker.track.keyframes]
        first, end = np.searchsorted(scans, tracker.starts[session : session + 2]).tolist()
        return range(first, min(end, stop))

    def _around(self, middle: int, allowed: range) -> range:
        """Return the keyframes around one that a sub-map joins."""
        settings = self.settings.loops
        near = np.flatnonzero(np.abs(self._distances - self._distances[middle]) <= settings.length)
        first = min(max(int(near[0]), middle - settings.keyframes), middle - settings.fewest)
        last = max(min(int(near[-1]), middle + settings.keyframes), middle + settings.fewest)
        return range(max(first, allowed.start), min(last + 1, allowed.stop))

    def _pose_of(self, keyframe: int) -> NDArray[np.float64]:
        return self.tracker.track.keyframes[keyframe].pose

    def _points_of(self, keyframe: int) -> ScanPoints:
        return self.tracker.points_of(self.tracker.track.keyframes[keyframe].scan)
