"""Independent streams of random numbers from one seed."""

from __future__ import annotations

from enum import IntEnum

import numpy as np


class Role(IntEnum):
    """The purpose of a stream of random numbers. Data sets depend on the values: never reuse or reorder them."""

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
    PEOPLE = 20
    DOORS = 21
    MOVED_OBJECTS = 22
    GLASS = 23
    RAMPS = 24
    WHEEL_SLIP = 25
    SCAN_DELAY = 26
    PARTICLE_FILTER = 27
    DRAFTING = 28
    DISTURBANCE = 29


def check_seed(seed: int) -> None:
    """Raise ``ValueError`` if a seed is negative or has more than 128 bits, which numpy does not mix."""
    if not 0 <= seed < 2**128:
        raise ValueError(f"seed is {seed}, must be at least 0 and below 2^128")


def stream(seed: int, role: Role, index: int = 0) -> np.random.Generator:
    """Return the random numbers of one role of one robot, world or pair, independent of all other roles and indices.

    Raises ``ValueError`` as ``check_seed`` does, and if the index is negative.
    """
    check_seed(seed)
    if index < 0:
        raise ValueError(f"index is {index}, must be at least 0")
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(index, int(role))))


def derived_seed(seed: int, role: Role, index: int = 0) -> int:
    """Derive an independent seed below 2^31 for one part. Raises ``ValueError`` as ``stream`` does."""
    return int(stream(seed, role, index).integers(2**31))
