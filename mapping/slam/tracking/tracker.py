"""Front end: match each scan to the map of the latest keyframes, and link the keyframes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mapping.robot.robot_log import RobotLog
from mapping.slam.correlation import (
    LikelihoodField,
    angle_step,
    correlate,
    likelihood_field,
    peaks,
    search_angles,
    thinned,
)
from mapping.slam.linear_algebra import inverse, product, transformed
from mapping.slam.link import Link
from mapping.slam.planar import between, compose, move_points, rotation, turn_vectors
from mapping.slam.settings import LocalMapSettings, SlamSettings
from mapping.slam.tracking.matching import Match, match_scan
from mapping.slam.tracking.motion import OdometryLevel, motion_covariance
from mapping.slam.tracking.points import REFERENCE_RANGE, ScanPoints, range_deviation, scan_points
from mapping.slam.tracking.surfels import SurfelMap, surfel_map


@dataclass(frozen=True, eq=False)
class Keyframe:
    """A scan that stays in the map: its index in the log and its pose (3,) when it was tracked.

    ``path`` [m] and ``turned`` [rad] lead from the keyframe before it, ``distance`` [m] is the path from the start.
    """

    scan: int
    pose: NDArray[np.float64]
    path: float
    turned: float
    distance: float


@dataclass
class Track:
    """Poses (N, 3) of all scans in the frame of the first, and for each scan the latest keyframe (N,), counted from 0;
    the keyframes, and the links between them."""

    poses: NDArray[np.float64]
    owners: NDArray[np.int64]
    keyframes: list[Keyframe] = field(default_factory=list)
    links: list[Link] = field(default_factory=list)

    def distances(self) -> NDArray[np.float64]:
        """Return the path driven until each keyframe [m], (K,)."""
        return np.array([keyframe.distance for keyframe in self.keyframes])


@dataclass(frozen=True, eq=False)
class _Prediction:
    """Predicted pose (3,) with its covariance (3, 3), and the pose ``guess`` (3,) at which the match begins.

    ``unit`` (3, 3) is the covariance of the odometry at noise level 1 in a frame that ``turn`` (3, 3) takes to the
    track's; None without odometry.
    """

    pose: NDArray[np.float64]
    guess: NDArray[np.float64]
    covariance: NDArray[np.float64]
    turn: NDArray[np.float64]
    unit: NDArray[np.float64] | None


class Tracker:
    """Track a robot scan by scan; the logs of several are tracked one after the other.

    Scans are counted through all logs; ``starts`` is the number of the first scan of each, and of one past the last.
    ``noise`` holds the estimated noise level of the odometry, ``voxel`` [m] is the side of the surfels.
    """

    def __init__(self, logs: Sequence[RobotLog], settings: SlamSettings) -> None:
        self.logs = logs
        self.settings = settings
        self.starts = np.cumsum([0, *(len(log.scans) for log in logs)])
        self.odometry = np.concatenate([log.odometry.from_start().poses for log in logs])
        self.track = Track(np.zeros((len(self.odometry), 3)), np.zeros(len(self.odometry), np.int64))
        self.noise = OdometryLevel(settings.motion)
        local = settings.local_map
        self._deviations = [range_deviation(log.scans, settings.points) for log in logs]
        side = local.voxel_deviations * max(deviation.at(REFERENCE_RANGE) for deviation in self._deviations)
        self.voxel = float(np.clip(side, local.least_voxel, local.greatest_voxel))
        self._surfels: SurfelMap | None = None
        self._field: LikelihoodField | None = None
        self._latest: list[ScanPoints] = []
        self._path, self._turned = 0.0, 0.0
        self._usual_share = 1.0

    def session_of(self, index: int) -> int:
        """Return the number of the log that scan ``index`` belongs to."""
        return int(np.searchsorted(self.starts, index, side="right")) - 1

    def points_of(self, index: int) -> ScanPoints:
        """Compute the points of scan ``index``."""
        session = self.session_of(index)
        log, scan = self.logs[session], index - int(self.starts[session])
        return scan_points(log.scans[scan], log.base_from_lidar, self._deviations[session], self.settings.points)

    def begin(self, index: int, relative: NDArray[np.float64]) -> None:
        """Start the log whose first scan is ``index``, at a pose (3,) seen from the last keyframe: a new local map.

        The keyframe is linked to the last one as uncertainly as ``SessionSettings`` say.
        """
        track, rule = self.track, self.settings.sessions
        last, stop = track.keyframes[-1], self.starts[self.session_of(index) + 1]
        pose, driven = compose(last.pose, relative), compose(self.odometry[last.scan], relative)
        for scan in range(index, int(stop)):
            self.odometry[scan] = compose(driven, self.odometry[scan])
        track.poses[index] = pose
        self._latest, self._path = [], rule.way
        self._add_keyframe(index, pose, self.points_of(index))
        covariance = np.diag(np.square([rule.deviation, rule.deviation, rule.yaw_deviation]))
        track.links.append(Link(len(track.keyframes) - 2, len(track.keyframes) - 1, relative, covariance))

    def add(self, index: int) -> bool:
        """Track scan ``index``, the next one; return True if it became a keyframe."""
        points, track = self.points_of(index), self.track
        if index == 0:
            self._add_keyframe(0, np.zeros(3), points)
            return True
        prediction = self._predict(index)
        match = self._match(points, prediction)
        track.poses[index] = match.pose
        track.owners[index] = len(track.keyframes) - 1
        driven = between(track.keyframes[-1].pose, match.pose)
        rule = self.settings.keyframes
        if math.hypot(driven[0], driven[1]) < rule.distance and abs(driven[2]) < rule.turn:
            return False
        self._learn(match, prediction)
        self._add_keyframe(index, match.pose, points)
        self._add_links(match)
        return True

    def _predict(self, index: int) -> _Prediction:
        """Predict the pose of a scan: by odometry since the last keyframe, or by the velocity of the last scans."""
        poses, last, motion = self.track.poses, self.track.keyframes[-1], self.settings.motion
        if not motion.odometry:
            self.odometry[index] = compose(poses[index - 1], self._velocity_step(index))
        step = between(self.odometry[index - 1] if motion.odometry else poses[index - 1], self.odometry[index])
        self._path += math.hypot(step[0], step[1])
        self._turned += abs(step[2])
        guess = compose(poses[index - 1], step)
        if not motion.odometry:
            return _Prediction(guess, guess, self._velocity_covariance(index), rotation(0.0), None)
        moved = between(self.odometry[last.scan], self.odometry[index])
        unit = motion_covariance(self._path, self._turned, motion)
        turn = rotation(last.pose[2] + 0.5 * moved[2])
        covariance = transformed(turn, self.noise.level**2 * unit)
        return _Prediction(compose(last.pose, moved), guess, covariance, turn, unit)

    def _velocity_step(self, index: int) -> NDArray[np.float64]:
        session = self.session_of(index)
        first = int(self.starts[session])
        if index - first < 2:
            return np.zeros(3)
        stamps, poses = self.logs[session].odometry.stamps, self.track.poses[first:]
        index -= first
        ratio = (stamps[index] - stamps[index - 1]) / (stamps[index - 1] - stamps[index - 2])
        step: NDArray[np.float64] = between(poses[index - 2], poses[index - 1]) * min(ratio, 2.0)
        return step

    def _velocity_covariance(self, index: int) -> NDArray[np.float64]:
        session = self.session_of(index)
        motion, stamps = self.settings.motion, self.logs[session].odometry.stamps
        seconds = stamps[index - self.starts[session]] - stamps[index - self.starts[session] - 1]
        shift = 0.5 * motion.acceleration * seconds**2 + self.settings.local_map.roughness
        turn = 0.5 * motion.turn_acceleration * seconds**2 + self.settings.local_map.roughness
        return np.diag(np.square([shift, shift, turn]))

    def _match(self, points: ScanPoints, prediction: _Prediction) -> Match:
        """Match a scan from where odometry leads; if that fails or may, from the best place of a correlation."""
        prior = inverse(prediction.covariance)
        settings, search = self.settings.match, self.settings.search
        spread = search.deviations * np.sqrt(np.diag(prediction.covariance))
        near = max(spread[0], spread[1]) < settings.first_reach and spread[2] < search.turn[0]
        match = match_scan(points, self._surfels, prediction.guess, (prediction.pose, prior), settings)
        usual = search.least_share * self._usual_share
        if near and match.share >= usual:
            self._usual_share += search.share_gain * (match.share - self._usual_share)
            return match
        if self._surfels is None or len(points.points) < search.fewest_points:
            return match
        start = self._correlated(points, prediction.pose, spread)
        if near:  # the wheels may have slipped: the prediction says little, and the scan must fit much better
            window = np.diag(np.square([search.shift[0], search.shift[0], search.turn[0]]))
            prior = inverse(prediction.covariance + window)
        other = match_scan(points, self._surfels, start, (prediction.pose, prior), settings)
        least = max(match.share + search.slip_gain, usual) if near else match.share
        return other if other.share > least else match

    def _correlated(
        self, points: ScanPoints, pose: NDArray[np.float64], spread: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the best pose of a correlation with the points of the local map, around a pose."""
        search = self.settings.search
        if self._field is None:
            frames = self.track.keyframes[-len(self._latest) :]
            walls = [move_points(one.pose, scan.points) for one, scan in zip(frames, self._latest, strict=True)]
            self._field = likelihood_field(np.concatenate(walls), search.cell, search.cell, 1.0)
        few = thinned(points.points, search.cell, search.points)
        step = angle_step(few, search.cell)
        reach = float(np.clip(max(spread[0], spread[1]), *search.shift))
        angles = search_angles(float(np.clip(spread[2], *search.turn)), step)
        scores = correlate(self._field, few, pose, reach, angles)
        found = peaks(scores, search.cell, angles, (search.cell, step), 1)
        return pose + found[0][1] if found else pose

    def _learn(self, match: Match, prediction: _Prediction) -> None:
        """Compare odometry with the scan alone, whose pose follows from that of both together."""
        if prediction.unit is None or match.share == 0.0:
            return
        scan = inverse(match.information)
        if not 0.0 < scan.diagonal().max() < self.settings.motion.largest_variance:
            return
        off = match.pose - prediction.pose
        off[2] = math.remainder(off[2], math.tau)
        turn = prediction.turn
        back = turn.T.copy()
        difference = product(back, product(scan, product(match.information + match.prior, off)))
        measured = transformed(back, scan)
        self.noise.add(difference, np.diag(prediction.unit), np.diag(measured))

    def _add_keyframe(self, scan: int, pose: NDArray[np.float64], points: ScanPoints) -> None:
        track = self.track
        track.owners[scan] = len(track.keyframes)
        distance = self._path + (track.keyframes[-1].distance if track.keyframes else 0.0)
        track.keyframes.append(Keyframe(scan, pose, self._path, self._turned, distance))
        self._path, self._turned = 0.0, 0.0
        self._latest = [*self._latest, points][-self.settings.local_map.keyframes :]
        poses = [keyframe.pose for keyframe in track.keyframes[-len(self._latest) :]]
        self._field = None
        self._surfels = surfels_of(self._latest, poses, self.voxel, self.settings.local_map)

    def _add_links(self, match: Match) -> None:
        """Link the latest keyframe to earlier ones; what the scan does not show, odometry since then must tell."""
        track, rule = self.track, self.settings.keyframes
        number = len(track.keyframes) - 1
        for back in rule.links:
            first = number - back
            if first < 0:
                continue
            way = track.keyframes[number].distance - track.keyframes[first].distance
            if back > 1 and way > rule.longest_link:
                continue
            a, b = track.keyframes[first].pose, track.keyframes[number].pose
            information, prior = match.information, match.prior
            if back > 1:
                information, prior = 0.5 * information, inverse(self._driven_covariance(first, b))
            covariance = transformed(rotation(-a[2]), inverse(information + prior))
            drift = self.noise.level**2 * way * np.diag(np.square([rule.drift, rule.drift, rule.yaw_drift]))
            track.links.append(Link(first, number, between(a, b), covariance + drift))

    def _driven_covariance(self, first: int, pose: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the covariance of the odometry since a keyframe, in the frame of the track."""
        driven = self.track.keyframes[first + 1 :]
        path, turned = sum(each.path for each in driven), sum(each.turned for each in driven)
        start = self.track.keyframes[first].pose
        direction = math.atan2(pose[1] - start[1], pose[0] - start[0]) if path > 0.0 else start[2]
        unit = motion_covariance(path, turned, self.settings.motion)
        return transformed(rotation(direction), self.noise.level**2 * unit)


def surfels_of(
    scans: Sequence[ScanPoints], poses: Sequence[NDArray[np.float64]], voxel: float, settings: LocalMapSettings
) -> SurfelMap | None:
    """Build the surfels of scans at poses; None if they have no point."""
    points = [move_points(pose, scan.points) for pose, scan in zip(poses, scans, strict=True)]
    normals = [turn_vectors(pose[2], scan.normals) for pose, scan in zip(poses, scans, strict=True)]
    return surfel_map(np.concatenate(points), np.concatenate(normals), voxel, settings)
