"""Joint ICP: the poses and scales of all maps of a cluster, refined on the walls of every pair at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from merge.alignment.correspondences import add_equations, add_equations_back
from merge.alignment.settings import AlignmentSettings
from merge.multimap.graph import Cluster, Edge, Pair, in_matching_order
from merge.multimap.overlap_likelihood import prepared_from_local
from merge.multimap.pose_graph import optimise_poses
from merge.multimap.settings import JointIcpSettings
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.surface import thinned
from merge.verification.wall_overlap import measure_wall_overlap

Prepared = Callable[[int], PreparedMap]
"""From the index of a map to the prepared map."""


def joint_icp(
    cluster: Cluster,
    prepared: Prepared,
    tolerances: Mapping[Pair, float],
    fixed_scale: bool,
    settings: JointIcpSettings = JointIcpSettings(),
    alignment: AlignmentSettings = AlignmentSettings(),
) -> Cluster:
    """Refine the poses and scales of a cluster together on the cells.

    Each round pairs every wall point with its nearest on the other map, for each edge (as ``refine`` does for one
    pair). The points of a pair make one quadratic form of four unknowns, exactly; SciPy's sparse least squares
    minimises the sum over all pairs. The gate narrows from round to round. ``tolerances`` are the distances at which
    walls of a pair still match [cells of the coarser map]. The poses stay if the walls agree less in the end, or if the
    cluster has no cycle.
    """
    if len(cluster.edges) < len(cluster.poses):
        return cluster
    poses, edge_of = dict(cluster.poses), {edge.pair: edge for edge in cluster.edges}
    in_turn = in_matching_order(list(edge_of))
    for step in range(settings.rounds):
        progress = step / (settings.rounds - 1)
        fits = {
            pair: _fit_edge(
                poses, edge_of[pair], prepared, tolerances.get(pair), progress, fixed_scale, settings, alignment
            )
            for pair in in_turn
        }
        edges = [fit for edge in cluster.edges if (fit := fits[edge.pair]) is not None]
        if len(edges) == len(cluster.edges):
            poses = optimise_poses(poses, edges, cluster.root, fixed_scale)
    refined = Cluster(poses, cluster.edges)
    before, after = (mean_score(each, prepared, settings.points, alignment) for each in (cluster, refined))
    return refined if after >= before - settings.max_score_loss else cluster


def mean_score(
    cluster: Cluster, prepared: Prepared, points: int, alignment: AlignmentSettings = AlignmentSettings()
) -> float:
    """Average the wall overlap score over the edges of a cluster."""
    scores, edge_of = {}, {edge.pair: edge for edge in cluster.edges}
    for pair in in_matching_order(list(edge_of)):
        edge = edge_of[pair]
        maps = prepared(edge.target), prepared(edge.source)
        pose = prepared_from_local(*maps, cluster.target_from_source(edge.target, edge.source))
        scores[pair] = measure_wall_overlap(*maps, pose, points, alignment.overlap).score
    return float(np.mean([scores[edge.pair] for edge in cluster.edges]))


def _fit_edge(
    poses: Mapping[int, Similarity2],
    edge: Edge,
    prepared: Prepared,
    tolerance: float | None,
    progress: float,
    fixed_scale: bool,
    settings: JointIcpSettings,
    alignment: AlignmentSettings,
) -> Edge | None:
    """Take one Gauss-Newton step of a pair by itself, as an edge; None if no walls are near one another."""
    target, source = prepared(edge.target), prepared(edge.source)
    now = poses[edge.target].inverse() @ poses[edge.source]
    last = settings.gate_tolerances * max(1.0, now.scale) * (tolerance or alignment.overlap.min_tolerance_cells)
    first = max(last, settings.first_gate_share * min(target.diagonal, now.scale * source.diagonal))
    gate = float(first * (last / first) ** progress)
    pose, line_weight = prepared_from_local(target, source, now), alignment.icp.line_weight
    equations = _normal_equations(target, source, pose, gate, settings.points, line_weight)
    hessian, gradient = equations[:, :4], equations[:, 4]
    if not hessian[0, 0] > 0.0:
        return None
    hessian = hessian + settings.stiffness * np.diag(np.diag(hessian)) + 1e-9 * np.eye(4)
    unknowns = 3 if fixed_scale else 4
    change = np.zeros(4)
    change[:unknowns] = np.linalg.solve(hessian[:unknowns, :unknowns], gradient[:unknowns])
    covariance = np.eye(4)
    covariance[:unknowns, :unknowns] = np.linalg.inv(hessian[:unknowns, :unknowns])
    return Edge(edge.target, edge.source, now.plus(change), covariance, edge.log_odds)


def _normal_equations(
    target: PreparedMap, source: PreparedMap, pose: Similarity2, gate: float, points: int, line_weight: float
) -> NDArray[np.float64]:
    """Sum the normal equations (4, 5), about the source's middle, of the points of both maps."""
    on_source, weight = thinned(len(source.points), points)
    on_target, back_weight = thinned(len(target.points), points)
    equations = np.zeros((4, 5))
    matrix, centre = pose.matrix(), pose.apply(source.middle)
    surfaces = target.surface, source.surface
    add_equations(*surfaces, on_source, weight * pose.scale, matrix, gate, line_weight, centre, equations)
    inverse = pose.inverse().matrix()
    gate = gate / pose.scale
    add_equations_back(*surfaces, on_target, back_weight, matrix, inverse, gate, line_weight, centre, equations)
    return equations
