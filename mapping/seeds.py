"""The one place where a seed becomes random numbers."""

from __future__ import annotations

from enum import IntEnum

import numpy as np


class Role(IntEnum):
    """What a stream of random numbers is for. The numbers are part of every data set: never reuse or reorder them."""

    WORLD = 0
    STARTS = 1
    RANGE_NOISE = 2
    DROPOUT = 3
    ODOMETRY_NOISE = 4
    DISGUISE = 5
    MERGE = 6
    SHORT_READINGS = 7
    RANDOM_READINGS = 8
    LIDAR_BIAS = 9
    ANGULAR_JITTER = 10
    ODOMETRY_BIAS = 11
    POLICY = 12
    TEAM_SCALE = 13
    DATASET_WORLD = 14
    DATASET_SAMPLE = 15
    DATASET_ORDER = 16
    DATASET_NEGATIVES = 17
    BENCHMARK_SAMPLE = 18
    BENCHMARK_BOOTSTRAP = 19


def check_seed(seed: int) -> None:
    """Raise ``ValueError`` where a seed is negative, or has more bits than numpy mixes."""
    if not 0 <= seed < 2**128:
        raise ValueError(f"seed is {seed}, must not be negative or have more than 128 bits")


def stream(seed: int, role: Role, index: int = 0) -> np.random.Generator:
    """Random numbers for one role of one robot (or world, or pair): independent of every other role and index.

    Raises ``ValueError`` as ``check_seed`` does, and where the index is negative.
    """
    check_seed(seed)
    if index < 0:
        raise ValueError(f"index is {index}, must not be negative")
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(index, int(role))))


def derived_seed(seed: int, role: Role, index: int = 0) -> int:
    """A seed of its own for a part of something larger, below 2^31. Raises ``ValueError`` as ``stream`` does."""
    return int(stream(seed, role, index).integers(2**31))
