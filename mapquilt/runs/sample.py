"""Sample of a mission: a team's maps and their ground truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame_perturbation import draw_frame_perturbations, perturb_frame
from mapping.grid.log_odds import map_log
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.sensor_model import sensor_model
from mapping.ground_truth.beam_endpoints import BeamEndpoints, beam_endpoints
from mapping.ground_truth.truth import (
    MapTruth,
    PairTruth,
    map_truth,
    pair_truth,
)
from mapping.map_set import MapSet
from mapping.particle.filter import particle_filter
from mapping.robot.robot_log import RobotLog, RobotTruth
from mapping.robot.trajectory import Trajectory
from mapping.seeds import Role, derived_seed
from mapping.settings import PARTICLE, MappingSettings
from mapping.slam.front_end import FRONT_ENDS
from mapping.slam.settings import TRUE_POSES
from mapquilt.runs.true_footprints import ObservedSlices, TrueFootprints, TrueMap, true_footprints
from mapquilt.runs.truth_file import RobotOrigin, RunTruth
from mapquilt.settings import SampleSettings
from sim.mission.mission import Mission
from sim.sensors.adversity.surroundings import draw_surroundings
from sim.sensors.sensing import SensedLog, sense


@dataclass(frozen=True, eq=False)
class Sample:
    """Hold a team's maps as the merger gets them, the logs behind them, the truth, and the true footprints."""

    maps: MapSet
    logs: tuple[RobotLog, ...]
    truth: RunTruth
    places: TrueFootprints

    def true_overlaps(self) -> dict[tuple[str, str], float]:
        """Return the true overlap of each pair of maps of different robots, by their names."""
        robot = {place.name: place.robot for place in self.places.maps}
        return {pair: each.overlap for pair, each in self.places.pairs.items() if robot[pair[0]] != robot[pair[1]]}


@dataclass(frozen=True, eq=False)
class _MapSample:
    log: RobotLog
    grid: OccupancyGrid
    start_from_map: Similarity2
    seen: BeamEndpoints
    truth: MapTruth


def sample_steps(robots: int, parts: int) -> int:
    """Count the progress steps of ``make_sample``: the footprint of each map, the overlap of each pair, each map."""
    maps = robots * parts
    return maps + maps * (maps - 1) // 2 + maps


def make_sample(
    mission: Mission,
    settings: SampleSettings,
    places: TrueFootprints | None = None,
    on_step: Callable[[], None] = lambda: None,
) -> Sample:
    """Sense a mission, build the maps, and perturb their frames; the same settings give the same sample.

    ``places`` can be shared by samples of one mission with the same number of parts. ``on_step`` is called after each
    of ``sample_steps``. Raises ``ValueError`` if a robot observed nothing to map.
    """
    if places is None:
        seen = ObservedSlices(mission, (settings.parts,), settings.mapping.clear_range)
        places = true_footprints(mission, settings.parts, seen, on_step)
    adversity, paths = settings.sensing.adversity, [truth.trajectory for truth in mission.robots]
    around = draw_surroundings(mission.world, paths, adversity, settings.seed)
    sensed = [
        sense(truth, settings.sensing.noise_of(lidar), settings.seed, index, around)
        for index, (truth, lidar) in enumerate(zip(mission.robots, lidar_names(mission), strict=True))
    ]
    perturbations = draw_frame_perturbations(settings.seed, len(places.maps), settings.perturbation)
    made = []
    for index, (place, start_from_map) in enumerate(zip(places.maps, perturbations, strict=True)):
        made.append(_make_map(sensed[place.robot], place, settings, start_from_map, index))
        on_step()
    names = places.names
    return Sample(
        maps=MapSet(
            names=names,
            grids=tuple(one.grid for one in made),
            units=tuple("m" for _ in made),
            resolutions_trusted=settings.perturbation.honest,
            provenance={"source": "simulation", "world": mission.world.name},
        ),
        logs=tuple(one.log for one in made),
        truth=RunTruth(_origins(places, made), _pair_truths(places, dict(zip(names, made, strict=True)))),
        places=places,
    )


def lidar_names(mission: Mission) -> tuple[str, ...]:
    """Name the preset of each robot's lidar."""
    return tuple(robot.lidar.model for robot in mission.settings.robots)


def _make_map(
    sensed: SensedLog, place: TrueMap, settings: SampleSettings, start_from_map: Similarity2, index: int
) -> _MapSample:
    log, truth = replace(sensed.log.part(place.start, place.stop), robot=place.name), place.truth
    poses, drawn = _draw(log, truth, settings, index)
    seen = beam_endpoints(log, truth, poses, sensed.outliers[place.start : place.stop])
    return _MapSample(
        log=log,
        grid=perturb_frame(drawn, start_from_map),
        start_from_map=start_from_map,
        seen=seen,
        truth=map_truth(seen, truth.trajectory.pose(0), start_from_map),
    )


def _draw(log: RobotLog, truth: RobotTruth, settings: SampleSettings, index: int) -> tuple[Trajectory, OccupancyGrid]:
    """Map a log; ``index`` counts the maps of the sample."""
    mapping = settings.mapping
    if mapping.mapper == PARTICLE:
        seed = derived_seed(settings.seed, Role.PARTICLE_FILTER, index)
        filtered = particle_filter(
            log, mapping.particle, seed, resolution=mapping.resolution, clear_range=mapping.clear_range
        )
        return filtered.trajectory, filtered.grid
    poses = _poses(log, truth, mapping)
    return poses, map_log(log, poses, mapping.resolution, sensor_model(mapping.sensor_model), mapping.clear_range)


def _poses(log: RobotLog, truth: RobotTruth, settings: MappingSettings) -> Trajectory:
    if settings.poses == TRUE_POSES:
        return truth.trajectory.from_start()
    return FRONT_ENDS[settings.poses](log, settings.slam, lambda _: None).trajectory


def _origins(places: TrueFootprints, made: list[_MapSample]) -> tuple[RobotOrigin, ...]:
    return tuple(
        RobotOrigin(place.name, place.truth.trajectory.pose(0), one.start_from_map, one.truth)
        for place, one in zip(places.maps, made, strict=True)
    )


def _pair_truths(places: TrueFootprints, made: dict[str, _MapSample]) -> dict[tuple[str, str], PairTruth]:
    pairs = {}
    for (target, source), pair in places.pairs.items():
        a, b = made[target], made[source]
        pairs[target, source] = pair_truth(a.seen, b.seen, a.start_from_map, b.start_from_map, pair)
    return pairs
