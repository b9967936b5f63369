"""Records of a study: teams, failures, and all that one mission gave."""

from __future__ import annotations

from dataclasses import dataclass, field

from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.study.plan import Level

MAPS_FOLDER = "maps"
"""Folder of the maps in that of the study."""


@dataclass(frozen=True)
class TeamTrial:
    """A team's merge by one method at one level: number of joined maps, quality of the merged map against all that the
    team observed, and processor time on one thread."""

    mission: str
    world: str
    level: Level
    method: str
    maps: int
    joined: int
    iou_free: float
    f1_walls: float
    pairs: int
    seconds: float


@dataclass(frozen=True)
class Failure:
    """Reason why a mission could not be simulated, or not be mapped at a level."""

    mission: str
    level: Level | None
    reason: str


@dataclass
class MissionTrials:
    """Results of one mission, with its map files by path, and warnings."""

    pairs: list[EvaluatedPair] = field(default_factory=list)
    teams: list[TeamTrial] = field(default_factory=list)
    failures: list[Failure] = field(default_factory=list)
    files: dict[str, bytes] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
