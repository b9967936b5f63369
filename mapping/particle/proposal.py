"""Proposals: draw the pose of a particle from odometry, scan and map, and weigh it.

Source: Grisetti, Stachniss and Burgard, "Improved techniques for grid mapping with Rao-Blackwellized particle filters",
T-RO 23 (2007), section III.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.particle.matching import Endpoints, climb, log_likelihood
from mapping.particle.motion import motion_covariance, sample_motion
from mapping.particle.settings import MatchSettings, ParticleSettings
from mapping.particle.tiles import TiledMaps

_CORNERS = np.stack(np.meshgrid(*[(-1.0, 0.0, 1.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)


def propose(
    poses: NDArray[np.float64],
    motion: SE2,
    scan: Endpoints,
    maps: TiledMaps,
    settings: ParticleSettings,
    rng: np.random.Generator,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Move particles from ``poses`` (N, 3) by an odometry motion and a scan; return poses (N, 3) and log-weights (N,).

    ``maximum`` draws from the motion model and climbs to the maximum of the likelihood, which is the weight. The weight
    of ``gaussian`` is the likelihood summed over the proposal.
    """
    if settings.proposal == "maximum":
        drawn = sample_motion(poses, motion, settings.motion, rng)
        climbed = [_climb(pose, scan, maps, particle, settings.matching) for particle, pose in enumerate(drawn)]
    else:
        least = (settings.gaussian.least_motion, settings.gaussian.least_motion, settings.gaussian.least_turn)
        covariance = motion_covariance(motion, settings.motion) + np.diag(np.square(least))
        draws = rng.standard_normal(poses.shape)
        climbed = [
            _gaussian(pose, motion, covariance, draws[particle], scan, maps, particle, settings)
            for particle, pose in enumerate(poses)
        ]
    return np.array([pose for pose, _ in climbed]), np.array([weight for _, weight in climbed])


def _climb(
    pose: NDArray[np.float64], scan: Endpoints, maps: TiledMaps, particle: int, settings: MatchSettings
) -> tuple[NDArray[np.float64], float]:
    climbed: tuple[NDArray[np.float64], float] = climb(
        pose, scan, maps.map(particle), settings.first_step, settings.first_turn, settings.halvings
    )
    return climbed


def _gaussian(
    pose: NDArray[np.float64],
    motion: SE2,
    covariance: NDArray[np.float64],
    draws: NDArray[np.float64],
    scan: Endpoints,
    maps: TiledMaps,
    particle: int,
    settings: ParticleSettings,
) -> tuple[NDArray[np.float64], float]:
    """Draw a pose from the Gaussian that fits motion model times likelihood around the maximum."""
    start = SE2(*pose)
    predicted = start @ motion
    centre, _ = _climb(np.array([predicted.x, predicted.y, predicted.yaw]), scan, maps, particle, settings.matching)
    turned = SE2(yaw=start.yaw).adjoint()
    prior = np.linalg.inv(turned @ covariance @ turned.T)
    fit = settings.gaussian
    samples = centre + _CORNERS * (fit.spacing, fit.spacing, fit.yaw_spacing)
    logs = np.array([log_likelihood(sample, scan, maps.map(particle)) for sample in samples]) / fit.beams_per_reading
    apart = samples - (predicted.x, predicted.y, predicted.yaw)
    apart[:, 2] = np.arctan2(np.sin(apart[:, 2]), np.cos(apart[:, 2]))
    logs -= 0.5 * np.einsum("ki,ij,kj->k", apart, prior, apart)
    shares = np.exp(logs - logs.max())
    total = float(shares.sum())
    mean = shares @ samples / total
    around = samples - mean
    spread = (around.T * shares) @ around / total
    root = np.linalg.cholesky(spread + 1e-12 * np.eye(3))
    return mean + root @ draws, fit.beams_per_reading * (float(logs.max()) + math.log(total))
