import math

import numpy as np
import pytest

from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array
from merge.multimap.graph import Edge, EdgeTable, LocalFrame, edge_from_answer
from merge.multimap.pose_graph import (
    leave_one_out_residuals,
    optimise_poses,
    pack_poses,
    relative_pose_jacobian,
    unpack_poses,
)
from merge.records.result import PairResult

FRAMES = (
    LocalFrame(Similarity2(3.0, -2.0, 0.0, 0.05), 300.0, 1),
    LocalFrame(Similarity2(-40.0, 7.0, 0.4, 0.1), 150.0, 1),
)


def test_squared_errors_use_both_covariances():
    rng = np.random.default_rng(0)
    root, slack_root = rng.standard_normal((2, 4, 4))
    covariance, slack = root @ root.T + np.eye(4), slack_root @ slack_root.T
    measured, predicted = Similarity2(3.0, -2.0, 0.5, 1.2), Similarity2(2.0, -1.5, 0.7, 1.1)
    table = EdgeTable.of([Edge(0, 1, measured, covariance, 1.0)])
    off = predicted.minus(measured)
    for fixed, unknowns in ((True, 3), (False, 4)):
        both = (covariance + slack)[:unknowns, :unknowns]
        expected = off[:unknowns] @ np.linalg.inv(both) @ off[:unknowns]
        assert table.squared_errors(Similarity2Array.of([predicted]), fixed, slack)[0] == pytest.approx(expected)


def test_the_jacobian_equals_finite_differences():
    target, source = Similarity2(3.0, -2.0, 0.7, 1.3), Similarity2(-5.0, 4.0, -1.1, 0.8)

    def relative(values):
        a, b = (Similarity2(v[0], v[1], v[2], math.exp(v[3])) for v in (values[:4], values[4:]))
        between = a.inverse() @ b
        return np.array([between.x, between.y, between.yaw, math.log(between.scale)])

    at = np.array([*vars(target).values(), *vars(source).values()])
    at[[3, 7]] = np.log(at[[3, 7]])
    steps = np.eye(8) * 1e-6
    expected = np.stack([(relative(at + s) - relative(at - s)) / 2e-6 for s in steps], axis=-1)
    found = relative_pose_jacobian(Similarity2Array.of([source, target]), Similarity2Array.of([target, source]))[1]
    np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize("unknowns", [3, 4])
def test_poses_are_packed_and_unpacked(unknowns):
    poses = {0: Similarity2(), 3: Similarity2(1.0, 2.0, 3.0, 0.5), 7: Similarity2(-1.0, 0.0, 0.1, 2.0)}
    again = unpack_poses(pack_poses(poses, [3, 7], unknowns), poses, [3, 7], unknowns)
    for index, pose in poses.items():
        np.testing.assert_allclose(again[index].matrix(), pose.matrix(), atol=1e-12)


def test_a_cycle_distributes_its_error_by_covariance():
    """Three maps in a row; the third edge is 3 too long: each edge takes a share by its covariance."""
    step = Similarity2(10.0, 0.0)

    def edge(a, b, x, variance):
        return Edge(a, b, Similarity2(x, 0.0), np.diag([variance, variance, 1e-6, 1e-6]), 1.0)

    edges = [edge(0, 1, 10.0, 1.0), edge(1, 2, 10.0, 1.0), edge(0, 2, 23.0, 1.0)]
    found = optimise_poses({0: Similarity2(), 1: step, 2: step @ step}, edges, 0, fixed_scale=True)
    assert found[1].x == pytest.approx(11.0, abs=1e-4)
    assert found[2].x == pytest.approx(22.0, abs=1e-4)
    surer = [*edges[:2], edge(0, 2, 23.0, 1e-6)]
    assert optimise_poses(found, surer, 0, fixed_scale=True)[2].x == pytest.approx(23.0, abs=1e-4)


def test_a_metric_covariance_is_converted_to_a_motion_about_the_middle():
    """Checked by many draws of the parameters."""
    truth = Similarity2(100.0, -50.0, 0.6, 2.0)
    rng = np.random.default_rng(0)
    root = np.diag([0.3, 0.2, 0.002, 0.003]) @ rng.standard_normal((4, 4))
    covariance = root @ root.T
    pair = PairResult("a", "b", True, 0.9, None, truth, None, "m", None, covariance)
    edge = edge_from_answer(pair, (0, 1), FRAMES)
    moves = []
    for move in rng.multivariate_normal(np.zeros(4), covariance, 4000):
        drawn = Similarity2(truth.x + move[0], truth.y + move[1], truth.yaw + move[2], truth.scale + move[3])
        local = FRAMES[0].metres_from_local.inverse() @ drawn @ FRAMES[1].metres_from_local
        moves.append((local.x, local.y, local.yaw, math.log(local.scale)))
    scattered = np.cov(np.array(moves).T)
    bare = edge_from_answer(PairResult("a", "b", True, 0.9, None, truth, None, "m", None), (0, 1), FRAMES).covariance
    factor = edge.covariance[2, 2] / (bare[2, 2] + scattered[2, 2])  # a ceiling shrinks all alike
    np.testing.assert_allclose(
        edge.covariance, factor * (bare + scattered), rtol=0.15, atol=0.03 * edge.covariance[0, 0]
    )


@pytest.mark.parametrize("fixed", [True, False])
def test_a_leave_one_out_residual_is_the_drop_of_the_cost_without_the_edge(fixed):
    """Least squares with and without each edge: the cost drops by the residual. A bridge has none."""
    rng = np.random.default_rng(3)
    poses = {k: Similarity2(*rng.uniform(-20, 20, 2), rng.uniform(-3, 3)) for k in range(5)}
    pairs = [(0, 1), (1, 2), (2, 3), (0, 3), (0, 2), (3, 4)]
    edges = []
    for a, b in pairs:
        truth = poses[a].inverse() @ poses[b]
        move = np.array([0.1, 0.1, 0.005, 0.0]) * rng.standard_normal(4)
        if (a, b) == (0, 3):
            move[:2] += 0.5
        found = Similarity2(truth.x + move[0], truth.y + move[1], truth.yaw + move[2])
        edges.append(Edge(a, b, found, np.diag([0.1, 0.1, 0.005, 0.005]) ** 2, 1.0))

    def squares(held):
        optimum = optimise_poses(poses, held, 0, fixed)
        placed = [(Similarity2Array.of([optimum[e.target]]), Similarity2Array.of([optimum[e.source]])) for e in held]
        misfits = [
            EdgeTable.of([e]).squared_errors(t.inverse() @ s, fixed)[0] for e, (t, s) in zip(held, placed, strict=True)
        ]
        return sum(misfits), optimum

    whole, optimum = squares(edges)
    found = leave_one_out_residuals(optimum, edges, 0, fixed, 1e-6)
    for k in range(5):
        without, _ = squares([*edges[:k], *edges[k + 1 :]])
        assert found[k] == pytest.approx(whole - without, rel=0.03, abs=0.02)
    assert found[5] == 0.0
    assert int(np.argmax(found)) in (2, 3)  # no chord separates these two, so either may be wrong
