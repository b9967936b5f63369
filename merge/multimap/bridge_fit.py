"""How well the walls of all maps fit that meet where two clusters are laid over one another."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array
from merge.alignment.correspondences import add_equations, add_equations_back
from merge.multimap.bridge import Bridge
from merge.multimap.graph import Cluster, Edge, Pair
from merge.multimap.overlap_likelihood import prepared_from_local
from merge.multimap.team import Team
from merge.preparation.surface import thinned
from merge.verification.wall_overlap import measure_wall_overlap_by_tolerance

LEAST_MISFIT = 0.002
"""Misfits far below this are noise."""

USUAL_LENGTH = 300.0
"""A map is taken to have so much wall that fits as the walls of all maps do, beside what it has [wide cells]."""

MEASURED_ON, REFINED_ON = 30, 12
"""Pairs of maps that meet on which an alignment is measured and refined."""

HOPELESS, GIVEN_UP = 20.0, 25.0
"""An alignment of such a misfit is not refined, and not even measured on all maps that meet."""

UNSEEN = 2.0
"""So much wall more than seen is taken to be off, so that a short comparison is not sure [wide cells]."""

LEAST_GAIN = 0.1
"""An alignment is refined again if its misfit fell by this share."""

STEPS = 8
"""Steps by which an alignment is refined."""

GATES = 0.08, 0.012
"""Largest distance of walls that are paired in the first and in the last of them [of the smaller map's diagonal]."""

SLIDES = (-0.06, -0.04, -0.02, 0.02, 0.04, 0.06)
"""Steps by which an alignment that may slide is tried [of a map's diagonal]."""

HELD_STEPS, HELD_MISFIT = (-0.04, -0.02, 0.02, 0.04), 3.0
"""An alignment is held if it fits so many times worse when it is moved by these steps [of a map's diagonal]."""

Meeting = tuple[int, int, Similarity2]
"""A map of the first and one of the second cluster that meet, and the pose of the one from the other."""


class BridgeFit:
    """Measure and refine alignments of clusters of a team, on all maps that then meet."""

    def __init__(self, team: Team, clusters: Iterable[Cluster]) -> None:
        """Measure what share of the walls of each map is off the walls of its own cluster, as is usual for it."""
        self._team, self._diagonals = team, np.array([frame.diagonal for frame in team.frames])
        off, length = np.zeros((2, len(team.maps)))
        for cluster in clusters:
            for a, b, between in self._near(cluster.poses, cluster.poses):
                if a < b:
                    inliers, compared = self.compared(a, b, between)
                    off[[a, b]] += compared - inliers
                    length[[a, b]] += compared
        self._usual_of_all = max(float(off.sum() / max(length.sum(), 1.0)), LEAST_MISFIT)
        self._usual = (off + USUAL_LENGTH * self._usual_of_all) / (length + USUAL_LENGTH)

    def fitted(self, bridge: Bridge) -> Bridge:
        """Refine an alignment as long as it fits better, and measure it; one that is hopeless is not refined."""
        best = self.measured(bridge)
        while best.misfit <= HOPELESS:
            refined = self.measured(self.refined(best))
            if refined.misfit > (1.0 - LEAST_GAIN) * best.misfit:
                return min(best, refined, key=lambda each: each.misfit)
            best = refined
        return best

    def slid(self, bridge: Bridge) -> Bridge:
        """Fit an alignment, and also from places along the direction in which it slides; return the best."""
        best = self.fitted(bridge)
        if best.misfit > HOPELESS:
            return best
        return min((best, *map(self.fitted, self._along(best, SLIDES))), key=lambda each: each.misfit)

    def measured(self, bridge: Bridge) -> Bridge:
        """Measure an alignment on the maps that then meet."""
        off, expected, length = 0.0, 0.0, 0.0
        pairs: list[tuple[float, Pair]] = []
        for a, b, between in self._meeting(bridge):
            inliers, compared = self.compared(a, b, between)
            if compared == 0.0:
                continue
            usual = max(self._usual[a] + self._usual[b] - self._usual_of_all, self._usual_of_all / 4.0)
            off, expected, length = off + compared - inliers, expected + usual * compared, length + compared
            if off > GIVEN_UP * (expected + LEAST_MISFIT * length) and length > USUAL_LENGTH:
                break
            if inliers > 0.0:
                pairs.append((-inliers, (min(a, b), max(a, b))))
        noise = LEAST_MISFIT * length
        misfit = (off + noise + UNSEEN) / (expected + noise) if length > 0.0 else math.inf
        return replace(bridge, misfit=misfit, length=length, pairs=tuple(pair for _, pair in sorted(pairs)))

    def refined(self, bridge: Bridge) -> Bridge:
        """Move one cluster as a whole until the walls that meet fit best: ICP (Besl and McKay 1992) on all of them."""
        anchor, meeting = bridge.first.poses[bridge.between[0]], self._meeting(bridge)[:REFINED_ON]
        for gate in np.geomspace(*GATES, STEPS).tolist():
            equations = self._equations(bridge, gate, meeting)
            hessian = equations[:, :3] + 1e-9 * np.trace(equations[:, :3]) * np.eye(3)
            if not hessian[0, 0] > 0.0:
                return bridge
            move = Similarity2(*np.linalg.solve(hessian, equations[:, 3]).tolist())
            bridge = replace(bridge, first_from_second=anchor @ move @ anchor.inverse() @ bridge.first_from_second)
        return bridge

    def holds(self, bridge: Bridge) -> bool:
        """Test if the walls that meet hold an alignment in every direction; those of a bare corridor do not."""
        moved = (self.measured(each) for each in self._along(bridge, HELD_STEPS))
        return all(each.misfit > HELD_MISFIT * bridge.misfit for each in moved)

    def is_at(self, bridge: Bridge, edge: Edge) -> bool:
        """Test if an edge puts its source where a bridge does, far nearer than the steps by which that is held."""
        moved = bridge.placed.target_from_source(edge.target, edge.source).inverse() @ edge.target_from_source
        nearest = min(map(abs, HELD_STEPS)) / 2.0 * self._team.frames[edge.source].diagonal
        return math.hypot(moved.x, moved.y) < nearest

    def _along(self, bridge: Bridge, steps: Sequence[float]) -> list[Bridge]:
        """Move an alignment along the direction in which its walls hold it least, by shares of a map's diagonal."""
        weakest = np.linalg.eigh(self._equations(bridge, GATES[-1])[:2, :2])[1][:, 0]
        anchor, diagonal = bridge.first.poses[bridge.between[0]], self._team.frames[bridge.between[0]].diagonal
        moves = (anchor @ Similarity2(*(step * diagonal * weakest).tolist()) @ anchor.inverse() for step in steps)
        return [replace(bridge, first_from_second=move @ bridge.first_from_second) for move in moves]

    def _equations(self, bridge: Bridge, gate: float, meeting: Sequence[Meeting] | None = None) -> NDArray[np.float64]:
        """Sum the normal equations (3, 4) of all maps that meet, by x, y [wide cells] and yaw [rad] of a move.

        The move is that of the second cluster, in the frame of the first map ``between``.
        """
        meeting = self._meeting(bridge)[:REFINED_ON] if meeting is None else meeting
        return sum((self._equations_of(bridge, a, b, gate) for a, b, _ in meeting), np.zeros((3, 4)))

    def _equations_of(self, bridge: Bridge, a: int, b: int, gate: float) -> NDArray[np.float64]:
        """Return those (3, 4) of the walls of two maps that are nearer than the gate [of the smaller diagonal]."""
        settings, target, source = self._team.settings, *map(self._team.likelihood.prepared, (a, b))
        pose = prepared_from_local(target, source, bridge.target_from_source(a, b))
        near = gate * min(target.diagonal, pose.scale * source.diagonal)
        points, line_weight = settings.multimap.selection.coarse_points // 2, settings.alignment.icp.line_weight
        (here, weight), (back, back_weight) = (thinned(len(each.points), points) for each in (source, target))
        surfaces, matrix, centre = (target.surface, source.surface), pose.matrix(), pose.apply(source.middle)
        found = np.zeros((4, 5))
        add_equations(*surfaces, here, weight * pose.scale, matrix, near, line_weight, centre, found)
        inverse = pose.inverse().matrix()
        add_equations_back(*surfaces, back, back_weight, matrix, inverse, near / pose.scale, line_weight, centre, found)
        cells_from_anchor = Similarity2(*target.middle.tolist()) @ bridge.first.poses[a].inverse()
        cells_from_anchor = cells_from_anchor @ bridge.first.poses[bridge.between[0]]
        moves = (Similarity2(*centre.tolist()).inverse() @ cells_from_anchor).adjoint()[:, :3]
        return np.asarray(moves.T @ np.column_stack((found[:, :4] @ moves, found[:, 4])))

    def compared(self, a: int, b: int, between: Similarity2) -> tuple[float, float]:
        """Return the length of the walls of two maps that match by the tightest tolerance, and that is compared.

        Both are 0 for maps that only touch: of their last cells as many are off as not.
        """
        team, maps = self._team, (self._team.likelihood.prepared(a), self._team.likelihood.prepared(b))
        points, overlap = team.settings.multimap.selection.coarse_points, team.settings.alignment.overlap
        walls = measure_wall_overlap_by_tolerance(*maps, prepared_from_local(*maps, between), points, overlap)[-1]
        if walls.compared_length < team.settings.multimap.likelihood.min_compared_cells:
            return 0.0, 0.0
        return walls.inlier_length, walls.compared_length

    def _meeting(self, bridge: Bridge) -> list[Meeting]:
        """List maps that meet around those between, one of the first and one of the second cluster, and poses.

        Those with the nearest middles come first, and are enough.
        """
        here, there = (self._around(*each) for each in zip((bridge.first, bridge.second), bridge.between, strict=True))
        return self._near(here, {b: bridge.first_from_second @ pose for b, pose in there.items()}, MEASURED_ON)

    def _near(
        self, here: Mapping[int, Similarity2], there: Mapping[int, Similarity2], most: int | None = None
    ) -> list[Meeting]:
        """List the maps of which one's middle lies about within the other, the nearest first, and relative poses."""
        rows, cols = np.array(list(here)), np.array(list(there))
        first, second = (Similarity2Array.of(poses.values()) for poses in (here, there))
        between = first.inverse()[:, None] @ second[None]
        reach = (self._diagonals[rows, None] + np.abs(between.turn) * self._diagonals[cols]) / 2.0
        apart = np.where(rows[:, None] == cols, np.inf, np.abs(between.shift) / reach)
        i, k = np.nonzero(apart <= 1.0)
        i, k = (each[np.lexsort((cols[k], rows[i], apart[i, k]))[:most]] for each in (i, k))
        return list(zip(rows[i].tolist(), cols[k].tolist(), between[i, k].similarities(), strict=True))

    def _around(self, cluster: Cluster, member: int) -> dict[int, Similarity2]:
        """Return the poses of the maps of a cluster whose middle is within the diagonal of a member of its own."""
        middle, reach = cluster.poses[member], self._team.frames[member].diagonal * cluster.poses[member].scale
        return {
            index: pose
            for index, pose in cluster.poses.items()
            if math.hypot(pose.x - middle.x, pose.y - middle.y) <= reach
        }
