"""Settings of a live merge."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from mapping.validation import require_valid
from merge.pair.settings import PairSettings
from merge.settings import MergeSettings


@dataclass(frozen=True)
class PlacementSettings:
    """Thresholds of the state machine that holds the pose of a robot's map in the merged frame.

    - ``join_confidence``: a map joins only by a chain of pairs at least so certain. A merge of files accepts at 0.5,
      but no robot drives by it;
    - ``confirmations``: so many updates with new cells must give the same pose before a map joins;
    - ``gate`` [standard deviations]: poses nearer than this, by the uncertainties of both, are one answer;
    - ``blend``: share of the way to a new pose that an update moves a map;
    - ``max_step`` [m], ``max_turn`` [rad]: bounds of that move, at the middle of the map; a planner sees no jump;
    - ``patience``: a join that new cells contradict so many times in a row is taken back;
    - ``long_patience``: so is one that no accepted pair supports any more, although nothing contradicts it.
    """

    join_confidence: float = 0.95
    confirmations: int = 3
    gate: float = 3.0
    blend: float = 0.3
    max_step: float = 0.05
    max_turn: float = math.radians(0.5)
    patience: int = 3
    long_patience: int = 12

    def __post_init__(self) -> None:
        require_valid(self, shares=("join_confidence", "blend"))


@dataclass(frozen=True)
class LiveSettings:
    """Settings of a live merge.

    - ``placement``: thresholds of the state machine of each map;
    - ``merge``: settings of the merger; refusals are not explained by other scales, which would cost as much again;
    - ``seed``: of the merger's random samples;
    - ``occupied``, ``free`` [percent]: a cell is a wall from ``occupied`` on and free up to ``free``, as
      nav2's map_saver has it;
    - ``silent_after`` [s]: a robot without a message for so long is silent; slam_toolbox publishes every 5 s;
    - ``still_after`` [s]: if no map has changed for so long, robots stand still: time confirms an answer, as no new
      cells will;
    - ``kept_share``: a map that keeps less of the cells that the robot's last one knew has a new frame: it restarted;
    - ``compared_cells``: so many cells are looked up for that;
    - ``growth``: a pair is matched again from scratch once a map of it knows this share of cells more, in case its maps
      fit better elsewhere by then;
    - ``same_place`` [m], ``same_yaw`` [rad]: matches of a pair nearer than this are at the same place;
    - ``full_matches``: pairs matched from scratch in one update, which bounds its time;
    - ``guided_matches``: pairs matched again near their last answer in one update.
    """

    placement: PlacementSettings = field(default_factory=PlacementSettings)
    merge: MergeSettings = field(default_factory=lambda: MergeSettings(pair=PairSettings(explains_refusals=False)))
    seed: int = 0
    occupied: int = 65
    free: int = 25
    silent_after: float = 15.0
    still_after: float = 15.0
    kept_share: float = 0.5
    compared_cells: int = 4000
    growth: float = 0.2
    same_place: float = 1.0
    same_yaw: float = math.radians(5.0)
    full_matches: int = 1
    guided_matches: int = 12

    def __post_init__(self) -> None:
        require_valid(self, shares=("kept_share",), not_negative=("seed",))
        if not self.free < self.occupied <= 100:
            raise ValueError(
                f"LiveSettings: free is {self.free} and occupied {self.occupied}, must be in order and at most 100"
            )
