"""Inverse sensor models of well-known mappers: the evidence of a hit and of a miss."""

from __future__ import annotations

import math
from dataclasses import dataclass


def logit(probability: float) -> float:
    """Convert a probability to log-odds."""
    return math.log(probability / (1.0 - probability))


@dataclass(frozen=True)
class LogOddsModel:
    """Hits and misses add their log-odds, clamped to a range (Moravec and Elfes 1985; Yguel 2007 for the clamps).

    ``hit`` and ``miss`` are probabilities of occupancy given one reading; ``low`` and ``high`` log-odds.

    Raises ``ValueError`` if a hit lowers the occupancy, a miss raises it, or the clamps do not enclose zero.
    """

    name: str
    hit: float
    miss: float
    low: float
    high: float

    def __post_init__(self) -> None:
        if not 0.5 < self.hit < 1.0:
            raise ValueError(f"LogOddsModel {self.name}: hit is {self.hit}, must lie between 0.5 and 1")
        if not 0.0 < self.miss < 0.5:
            raise ValueError(f"LogOddsModel {self.name}: miss is {self.miss}, must lie between 0 and 0.5")
        if not -math.inf < self.low < 0.0 < self.high < math.inf:
            raise ValueError(f"LogOddsModel {self.name}: clamps {self.low} and {self.high} do not enclose zero")


@dataclass(frozen=True)
class CountingModel:
    """Hits over visits: a cell is occupied if the fraction exceeds ``threshold``, unknown below ``min_visits``.

    Raises ``ValueError`` if the threshold is not between 0 and 1, or ``min_visits`` is below 1.
    """

    name: str
    threshold: float
    min_visits: int = 1

    def __post_init__(self) -> None:
        if not 0.0 < self.threshold < 1.0:
            raise ValueError(f"CountingModel {self.name}: threshold is {self.threshold}, must lie between 0 and 1")
        if self.min_visits < 1:
            raise ValueError(f"CountingModel {self.name}: min_visits is {self.min_visits}, must be at least 1")


SensorModel = LogOddsModel | CountingModel

OCTOMAP = LogOddsModel("octomap", hit=0.7, miss=0.4, low=-2.0, high=3.5)
"""Hornung et al., "OctoMap", Autonomous Robots 34 (2013), section 3.2 and the library's defaults."""

HECTOR = LogOddsModel("hector", hit=0.9, miss=0.4, low=-50.0, high=50.0)
"""hector_mapping's update_factor_occupied and update_factor_free (Kohlbrecher et al., SSRR 2011); it stops adding
hits at 50."""

CARTOGRAPHER = LogOddsModel("cartographer", hit=0.55, miss=0.49, low=logit(0.1), high=logit(0.9))
"""Cartographer's hit_probability and miss_probability (Hess et al., ICRA 2016, equation 3); cells
stay in [0.1, 0.9]."""

COUNTING = CountingModel("counting", threshold=0.25)
"""gmapping's occ_thresh (Grisetti et al., T-RO 2007): occupied where over a quarter of the visits were hits."""

KARTO = CountingModel("karto", threshold=0.1, min_visits=3)
"""Karto's OccupancyThreshold of 0.1 and MinPassThrough of 2, as slam_toolbox ships them: `OccupancyGrid::UpdateCell`
leaves a cell unknown until it was passed more often than that."""

SENSOR_MODELS: dict[str, SensorModel] = {
    **{model.name: model for model in (OCTOMAP, HECTOR, CARTOGRAPHER, COUNTING, KARTO)},
    "gmapping": COUNTING,
}
"""Presets by name. ``gmapping`` is the mapper that counts hits and visits."""


def sensor_model(name: str) -> SensorModel:
    """Return the preset of a name. Raises ``ValueError`` that lists the presets if there is none."""
    if name not in SENSOR_MODELS:
        raise ValueError(f"sensor model is {name!r}, must be one of {', '.join(SENSOR_MODELS)}")
    return SENSOR_MODELS[name]
