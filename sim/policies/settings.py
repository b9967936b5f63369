"""Settings of the policies, and of everything that decides where robots drive."""

from __future__ import annotations

from dataclasses import dataclass, field

from sim.navigation.settings import NavigationSettings, require_positive


@dataclass(frozen=True)
class FrontierSettings:
    """Set up the search for frontiers and the area that is visible from them.

    - ``min_cells``: frontiers of fewer cells are gaps between beams;
    - ``max_frontiers``: the largest ones that are looked at;
    - ``view`` [m]: radius within which unknown floor counts as visible;
    - ``viewpoint_distance`` [m]: greatest distance of a viewpoint from its frontier;
    - ``directions``: rays that are cast from a viewpoint.
    """

    min_cells: int = 3
    max_frontiers: int = 40
    view: float = 4.0
    viewpoint_distance: float = 1.0
    directions: int = 48


@dataclass(frozen=True)
class ExplorationSettings:
    """Set up the policy ``explore``.

    - ``map_cell`` [m]: cell size of the robot's map;
    - ``map_period`` [s]: least time between two scans that are mapped; steering uses every scan;
    - ``visited_radius`` [m]: viewpoints nearer than this to the robot's past path are ignored: what looks unknown there
      are gaps in mapped walls;
    - ``persistence``: factor on the utility of the present goal, so that the robot does not switch back and forth;
    - ``same_goal`` [m]: viewpoints nearer than this to one another count as one;
    - ``heading_weight``: weight of the direction that the robot explores first;
    - ``min_area`` [m^2]: least unknown area that is worth a trip;
    - ``patience`` [s]: time without a viewpoint after which the robot has finished.
    """

    map_cell: float = 0.1
    map_period: float = 0.2
    visited_radius: float = 0.4
    persistence: float = 1.5
    same_goal: float = 0.7
    heading_weight: float = 0.6
    min_area: float = 0.4
    patience: float = 15.0
    frontiers: FrontierSettings = field(default_factory=FrontierSettings)


@dataclass(frozen=True)
class PatrolSettings:
    """Set up the policy ``patrol``: ``plan_cell`` [m], the cell size of the floor plan that a robot knows, and
    ``goal_count``, the number of goals that it draws if none are given."""

    plan_cell: float = 0.1
    goal_count: int = 8


@dataclass(frozen=True)
class BehaviourSettings:
    """Set up how robots choose where to drive, and how they get there.

    Raises ``ValueError`` with the field and its value.
    """

    navigation: NavigationSettings = field(default_factory=NavigationSettings)
    exploration: ExplorationSettings = field(default_factory=ExplorationSettings)
    patrol: PatrolSettings = field(default_factory=PatrolSettings)

    def __post_init__(self) -> None:
        require_positive(self, negative=("free_log_odds",))
