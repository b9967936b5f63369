"""truth.json: the ground truth of a run, which the merger never opens."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.ground_truth.ambiguity_search import Identifiability
from mapping.ground_truth.truth import MapTruth, PairOverlap, PairTruth
from mapquilt.json_file import read_record, similarity_from_record, similarity_record, write_record

SCHEMA = "mapquilt-truth/2"


@dataclass(frozen=True)
class RobotOrigin:
    """Hold a robot's start ``world_from_start``, the frame perturbation of its map ``start_from_map``, and the truth
    of its map."""

    name: str
    world_from_start: SE2
    start_from_map: Similarity2
    truth: MapTruth


@dataclass(frozen=True)
class RunTruth:
    """Hold the truth of all maps, in order, and of each pair (target first)."""

    robots: tuple[RobotOrigin, ...]
    pairs: dict[tuple[str, str], PairTruth]

    def robot(self, name: str) -> RobotOrigin:
        for robot in self.robots:
            if robot.name == name:
                return robot
        raise ValueError(f"the truth has no map {name!r}")


def save_truth(path: Path, truth: RunTruth) -> None:
    robots = [_robot_record(robot) for robot in truth.robots]
    pairs = [_pair_record(target, source, pair) for (target, source), pair in truth.pairs.items()]
    write_record(path, "truth", {"schema": SCHEMA, "robots": robots, "pairs": pairs})


def _robot_record(robot: RobotOrigin) -> dict[str, Any]:
    start = robot.world_from_start
    return {
        "name": robot.name,
        "world_from_start": {"x": start.x, "y": start.y, "yaw": start.yaw},
        "start_from_map": similarity_record(robot.start_from_map),
        "world_from_map": similarity_record(robot.truth.world_from_map),
        "world_from_start_map": similarity_record(robot.truth.world_from_start_map),
        "distortion_m": robot.truth.distortion,
    }


def _pair_record(target: str, source: str, pair: PairTruth) -> dict[str, Any]:
    return {
        "target": target,
        "source": source,
        "target_from_source": similarity_record(pair.target_from_source),
        "fitted": pair.fitted,
        "common_wall_cells": pair.common_cells,
        "residual_m": pair.residual,
        "overlap": pair.footprints.overlap,
        "identifiable": pair.footprints.identifiability.identifiable,
        "true_score": pair.footprints.identifiability.score,
        "second_best_score": pair.footprints.identifiability.second_best,
    }


def load_truth(path: Path) -> RunTruth:
    """Read the truth, of this schema or the one before. Raises ``ValueError`` or ``OSError`` naming file and fault."""
    record = read_record(path, "truth")
    robots = tuple(_robot(entry) for entry in record["robots"])
    return RunTruth(robots, {(entry["target"], entry["source"]): _pair(entry) for entry in record["pairs"]})


def _robot(entry: dict[str, Any]) -> RobotOrigin:
    start = entry["world_from_start"]
    return RobotOrigin(
        entry["name"],
        SE2(start["x"], start["y"], start["yaw"]),
        similarity_from_record(entry["start_from_map"]),
        MapTruth(
            similarity_from_record(entry["world_from_map"]),
            similarity_from_record(entry["world_from_start_map"]),
            entry["distortion_m"],
        ),
    )


def _pair(entry: dict[str, Any]) -> PairTruth:
    return PairTruth(
        similarity_from_record(entry["target_from_source"]),
        entry["fitted"],
        entry["common_wall_cells"],
        entry["residual_m"],
        PairOverlap(entry["overlap"], Identifiability(entry["true_score"], entry["second_best_score"])),
    )
