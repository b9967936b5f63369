"""Relations between poses of a log, known without a map, as the SLAM benchmark of Kuemmerle et al. publishes them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.io.safe_load import read_lines
from mapping.numbers import parse_number

_NUMBERS = 8


@dataclass(frozen=True, eq=False)
class Relations:
    """True motions: ``stamps`` (N, 2) [s] of two poses, and ``first_from_second`` (N, 3) x, y [m], yaw [rad]."""

    stamps: NDArray[np.float64]
    first_from_second: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "stamps", frozen_array(self.stamps, np.float64))
        object.__setattr__(self, "first_from_second", frozen_array(self.first_from_second, np.float64))


def load_relations(path: Path) -> Relations:
    """Read lines ``stamp1 stamp2 x y z roll pitch yaw``; z, roll and pitch are dropped.

    Format: Kuemmerle et al. 2009, "On measuring the accuracy of SLAM algorithms", Autonomous Robots 27, and
    ais.informatik.uni-freiburg.de/slamevaluation. Raises ``ValueError`` naming file and line if a line is not eight
    numbers or there is none; ``OSError`` if the file cannot be read.
    """
    rows = []
    for number, line in enumerate(read_lines(path), start=1):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        try:
            rows.append([parse_number(word) for word in words])
        except ValueError as error:
            raise ValueError(f"{path}: line {number}: {error}") from None
        if len(words) != _NUMBERS:
            raise ValueError(
                f"{path}: line {number} has {len(words)} numbers, must be stamp1 stamp2 x y z roll pitch yaw"
            )
    if not rows:
        raise ValueError(f"{path}: no relation")
    table = np.array(rows)
    return Relations(table[:, :2], table[:, [2, 3, 7]])
