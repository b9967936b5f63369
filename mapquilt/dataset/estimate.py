"""Estimate of what a data set will hold, before it is made."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mapquilt.dataset.plan import DatasetPlan, MissionPlan
from mapquilt.settings import SampleSettings


@dataclass(frozen=True)
class Costs:
    """Cost of the steps on one core of 2 GHz. Measured on missions of house and office, 2 to 3 robots, 20 to 60 s.

    - ``seconds_per_scan``: of the simulation, one attempt;
    - ``seconds_per_slam_scan``: of a map at the poses of SLAM; the particle filter takes about as long;
    - ``seconds_per_mapped_scan``: of a map at other poses;
    - ``bytes_per_mission_reading`` and ``bytes_per_sample_reading``: of the stored files;
    - ``bytes_per_map``: of the map and its true raster.
    """

    seconds_per_scan: float = 0.0025
    seconds_per_slam_scan: float = 0.005
    seconds_per_mapped_scan: float = 0.0005
    bytes_per_mission_reading: float = 5.2
    bytes_per_sample_reading: float = 4.5
    bytes_per_map: float = 120_000.0


@dataclass(frozen=True)
class Estimate:
    """Hold counts, the time of all work on one core [h], and the size on disk [GB]. Missions that are cut to an
    overlap may take several attempts: ``most_hours``."""

    missions: int
    samples: int
    maps: int
    pairs: int
    negatives: int
    hours: float
    most_hours: float
    gigabytes: float


def estimate(plan: DatasetPlan, costs: Costs = Costs()) -> Estimate:
    """Estimate what a planned data set will hold and cost."""
    settings = [(mission, sample.settings) for mission in plan.missions for sample in mission.samples]
    simulated = [_scans(mission) * costs.seconds_per_scan for mission in plan.missions]
    attempts = [
        1 if mission.missions.overlap is None else 2 + mission.missions.settings().cut.draws
        for mission in plan.missions
    ]
    mapped = sum(_scans(mission) * _seconds(sample, costs) for mission, sample in settings)
    size = sum(_readings(mission) for mission in plan.missions) * costs.bytes_per_mission_reading
    size += sum(
        _readings(mission) * costs.bytes_per_sample_reading + _maps(mission, sample) * costs.bytes_per_map
        for mission, sample in settings
    )
    most = sum(seconds * count for seconds, count in zip(simulated, attempts, strict=True))
    return Estimate(
        missions=len(plan.missions),
        samples=len(settings),
        maps=sum(_maps(mission, sample) for mission, sample in settings),
        pairs=sum(math.comb(mission.missions.robots, 2) * sample.parts**2 for mission, sample in settings),
        negatives=len(plan.negatives),
        hours=(sum(simulated) + mapped) / 3600.0,
        most_hours=(most + mapped) / 3600.0,
        gigabytes=size / 1e9,
    )


def _scans(mission: MissionPlan) -> float:
    """Return the number of scans of all robots."""
    return sum(robot.lidar.rate for robot in mission.missions.settings().robots) * mission.missions.duration


def _readings(mission: MissionPlan) -> float:
    return _scans(mission) * mission.missions.settings().robots[0].lidar.beams


def _maps(mission: MissionPlan, sample: SampleSettings) -> int:
    return mission.missions.robots * sample.parts


def _seconds(sample: SampleSettings, costs: Costs) -> float:
    own_poses = sample.mapping.pose_source in ("odometry", "truth")
    return costs.seconds_per_mapped_scan if own_poses else costs.seconds_per_slam_scan
