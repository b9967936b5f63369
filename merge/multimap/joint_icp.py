"""All maps of a group laid on one another at once: the walls of every pair, the poses and scales of every map."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from merge.alignment.correspondences import add_equations, add_equations_back
from merge.alignment.icp import LINE_SHARE
from merge.multimap.cluster import Cluster, predicted
from merge.multimap.edge import Edge
from merge.multimap.overlap_likelihood import on_charts
from merge.multimap.pose_graph import averaged
from merge.preparation.prepared_map import PreparedMap
from merge.verification.wall_overlap import TOLERANCE_CELLS, measure_wall_overlap, thinned

ROUNDS = 6
MOST_POINTS = 1500
GATE_TOLERANCES = 4.0
"""How far apart walls may lie and still be one, in tolerances of their pair: drift moves parts of a map against one
another, and a narrower gate would hear those only that happen to fit."""

FIRST_GATE_SHARE = 0.02
"""The same at first, at least, as a share of the smaller map's diagonal."""

WORSE = 0.02
"""How much less walls may agree in the end than before: the mean of a map that is bent lays no part of it best."""

STIFFNESS = 1e-3
"""What holds a pair that its walls let slide, as a share of what its walls hold."""

Tolerances = Mapping[tuple[int, int], float]
"""How far apart walls of a pair may lie and be one, in cells of the coarser map, by indices, lower first."""


def joint(group: Cluster, chart: Callable[[int], PreparedMap], tolerances: Tolerances, fixed_scale: bool) -> Cluster:
    """The group with poses and scales refined together on the cells.

    Every point of either surface of each pair that agrees is laid on its nearest on the other (as in
    ``refine``); what a pair's points say is one quadratic form of four unknowns, exactly, and the
    sum over all pairs is made least by SciPy's sparse least squares; then all is laid anew, with a narrower gate. Walls
    must agree nearly as well in the end as before, or the poses stay. A group without a cycle is as its pairs have it.
    """
    if len(group.edges) < len(group.poses):
        return group
    poses = dict(group.poses)
    for step in range(ROUNDS):
        laid = [_laid(poses, e, chart, tolerances, step / (ROUNDS - 1), fixed_scale) for e in group.edges]
        edges = [edge for edge in laid if edge is not None]
        if len(edges) == len(group.edges):
            poses = averaged(poses, edges, group.root, fixed_scale)
    refined = Cluster(poses, group.edges)
    return refined if agreement(refined, chart) >= agreement(group, chart) - WORSE else group


def agreement(group: Cluster, chart: Callable[[int], PreparedMap]) -> float:
    """How well the walls of all pairs of a group agree: the mean over its edges."""
    told = []
    for edge in group.edges:
        target, source = chart(edge.target), chart(edge.source)
        place = on_charts(target, source, predicted(group, edge.target, edge.source))
        told.append(measure_wall_overlap(target, source, place, MOST_POINTS).score)
    return float(np.mean(told))


def _laid(
    poses: Mapping[int, Similarity2],
    edge: Edge,
    chart: Callable[[int], PreparedMap],
    tolerances: Tolerances,
    progress: float,
    fixed_scale: bool,
) -> Edge | None:
    """What the walls of a pair say where the poses lay it; None where none lie near one another."""
    target, source = chart(edge.target), chart(edge.source)
    now = poses[edge.target].inverse() @ poses[edge.source]
    gate = _gate(
        target,
        source,
        now.scale,
        tolerances.get((min(edge.target, edge.source), max(edge.target, edge.source))),
        progress,
    )
    equations = _equations(target, source, on_charts(target, source, now), gate)
    hessian, gradient = equations[:, :4], equations[:, 4]
    if not hessian[0, 0] > 0.0:
        return None
    hessian = hessian + STIFFNESS * np.diag(np.diag(hessian)) + 1e-9 * np.eye(4)
    unknowns = 3 if fixed_scale else 4
    move = np.zeros(4)
    move[:unknowns] = np.linalg.solve(hessian[:unknowns, :unknowns], gradient[:unknowns])
    moved = now.plus(move)
    covariance = np.eye(4)
    covariance[:unknowns, :unknowns] = np.linalg.inv(hessian[:unknowns, :unknowns])
    return Edge(edge.target, edge.source, moved, covariance, edge.weight)


def _gate(target: PreparedMap, source: PreparedMap, scale: float, tolerance: float | None, progress: float) -> float:
    last = GATE_TOLERANCES * max(1.0, scale) * (tolerance or TOLERANCE_CELLS)
    first = max(last, FIRST_GATE_SHARE * min(target.diagonal, scale * source.diagonal))
    return float(first * (last / first) ** progress)


def _equations(target: PreparedMap, source: PreparedMap, place: Similarity2, gate: float) -> NDArray[np.float64]:
    """Normal equations (4, 5), about the source's middle, of the points of both surfaces: as one refinement's."""
    on_source, weight = thinned(len(source.points), MOST_POINTS)
    on_target, back_weight = thinned(len(target.points), MOST_POINTS)
    equations = np.zeros((4, 5))
    matrix, centre = place.matrix(), place.apply(source.middle)
    there, here = target.surface, source.surface
    add_equations(there, here, on_source, weight * place.scale, matrix, gate, LINE_SHARE, centre, equations)
    inverse = place.inverse().matrix()
    gate = gate / place.scale
    add_equations_back(there, here, on_target, back_weight, matrix, inverse, gate, LINE_SHARE, centre, equations)
    return equations
