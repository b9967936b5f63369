"""The pose graph against a slow oracle, and its uncertainties against composition by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from mapping.geometry.se2 import SE2
from mapping.slam.graph.pose_graph import chi_squared, optimise_poses, relative_covariances
from mapping.slam.link import Link, LinkTable
from mapping.slam.planar import between, compose

COVARIANCE = np.diag([0.01, 0.02, 0.001])


def chain(count, rng, noise=0.05):
    """Return true poses in a circle, noisy links along it, and one exact link that closes it."""
    angles = np.linspace(0.0, math.tau, count, endpoint=False)
    true = np.stack([3.0 * np.cos(angles), 3.0 * np.sin(angles), angles + math.pi / 2], axis=1)
    links = []
    for k in range(count - 1):
        relative = between(true[k], true[k + 1]) + noise * rng.standard_normal(3) * (1.0, 1.0, 0.3)
        links.append(Link(k, k + 1, relative, COVARIANCE))
    links.append(Link(count - 1, 0, between(true[-1], true[0]), 0.1 * COVARIANCE))
    poses = [true[0]]
    for link in links[:-1]:
        poses.append(compose(poses[-1], link.relative))
    return true, np.array(poses), links


@pytest.mark.parametrize("seed", range(3))
def test_the_solution_is_that_of_a_dense_solver(seed):
    _, start, links = chain(12, np.random.default_rng(seed))

    def residuals(free):
        poses = np.vstack((start[0], free.reshape(-1, 3)))
        errors = []
        for link in links:
            off = between(poses[link.first], poses[link.second]) - link.relative
            off[2] = math.remainder(off[2], math.tau)
            errors.append(off / np.sqrt(np.diag(link.covariance)))
        return np.concatenate(errors)

    oracle = least_squares(residuals, start[1:].ravel()).x.reshape(-1, 3)
    assert optimise_poses(start, links, 20, 3.0)[1:] == pytest.approx(oracle, abs=1e-4)


def test_links_that_agree_leave_nothing_to_correct():
    true, start, links = chain(15, np.random.default_rng(0), noise=0.0)
    solved = optimise_poses(start, links, 10, 3.0)
    assert chi_squared(solved, links) == pytest.approx(np.zeros(len(links)), abs=1e-12)
    assert solved[:, :2] == pytest.approx(true[:, :2], abs=1e-8)


def test_a_robust_link_that_contradicts_the_others_moves_little():
    true, start, links = chain(15, np.random.default_rng(0), noise=0.0)
    false = Link(2, 9, np.array([0.0, 0.0, 0.0]), 0.01 * COVARIANCE, robust=True)
    rigid = Link(2, 9, np.array([0.0, 0.0, 0.0]), 0.01 * COVARIANCE)
    robust = optimise_poses(start, [*links, false], 30, 3.0)
    spoiled = optimise_poses(start, [*links, rigid], 30, 3.0)
    error = [np.hypot(*(poses - true)[:, :2].T).max() for poses in (robust, spoiled)]
    assert error[0] < 0.1 * error[1]
    assert chi_squared(robust, [false])[0] > 25.0


@settings(max_examples=20, deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_covariances_along_a_chain_are_those_of_sampled_motions(x, y, yaw):
    links = [Link(0, 1, np.array([x, y, yaw]), COVARIANCE), Link(1, 2, np.array([1.0, 0.5, 0.3]), COVARIANCE)]
    poses = [np.zeros(3)]
    for link in links:
        poses.append(compose(poses[-1], link.relative))
    computed = relative_covariances(LinkTable.of(links), 0, np.array(poses))
    rng = np.random.default_rng(0)
    draws = rng.multivariate_normal(np.zeros(3), COVARIANCE, (4000, 2))
    ends = np.array([compose(links[0].relative + a, links[1].relative + b) for a, b in draws])
    sampled = np.cov((ends - poses[2]).T)
    assert computed[1] == pytest.approx(COVARIANCE)
    assert computed[2] == pytest.approx(sampled, abs=0.12 * np.sqrt(np.outer(np.diag(sampled), np.diag(sampled))).max())


def test_a_keyframe_that_no_link_reaches_has_no_certainty():
    links = [Link(0, 1, np.zeros(3), COVARIANCE)]
    assert np.isinf(relative_covariances(LinkTable.of(links), 0, np.zeros((3, 3)))[2]).all()


def test_an_edge_of_the_result_has_the_covariance_of_the_tangent():
    link = Link(0, 1, np.array([2.0, 1.0, 0.4]), COVARIANCE)
    edge = link.edge()
    rng = np.random.default_rng(1)
    draws = link.relative + rng.multivariate_normal(np.zeros(3), 1e-4 * COVARIANCE, 20000)
    mean = SE2(*link.relative)
    tangents = np.array([(SE2(*draw) @ mean.inverse()).log() for draw in draws])
    assert np.cov(tangents.T) == pytest.approx(1e-4 * edge.covariance, abs=4e-8)
