"""Settings of SLAM, one class for each step."""

from __future__ import annotations

from dataclasses import dataclass, field

from mapping.validation import require_ordered, require_valid

TRUE_POSES = "truth"
"""Not a front end: the true poses, which no robot knows."""

POSES = ("slam", "odometry", TRUE_POSES)
"""Values of ``mapping.poses``: the front ends of ``mapping/slam/front_end.py``, and the true poses."""


@dataclass(frozen=True)
class PointSettings:
    """Turn a scan into points with normals.

    - ``neighbours``, ``most_neighbours``: number of beams on either side that a normal is fitted to;
    - ``normal_error`` [rad]: standard deviation of a normal; the number of beams is chosen for it;
    - ``jump_beams``: a surface ends where neighbouring ranges differ by more than this number of beam spacings, and by
      more than their noise;
    - ``least_deviation`` [m]: lower bound of the standard deviation of ranges, which is estimated from the log.
    """

    neighbours: int = 4
    most_neighbours: int = 12
    normal_error: float = 0.15
    jump_beams: float = 6.0
    least_deviation: float = 0.01

    def __post_init__(self) -> None:
        require_valid(self)
        if self.most_neighbours < self.neighbours:
            raise ValueError(
                f"PointSettings: most_neighbours is {self.most_neighbours}, must be at least {self.neighbours}"
            )


@dataclass(frozen=True)
class LocalMapSettings:
    """Model the surroundings by surfels: mean and covariance of the points in a voxel.

    - ``keyframes``: number of latest keyframes in the map;
    - ``voxel_deviations``: side of a voxel in standard deviations of a range of 4 m, within ``least_voxel`` and
      ``greatest_voxel`` [m]: a voxel must be wider than the noise of a wall;
    - ``line_ratio``: a surfel is a line if its small variance is below this share of the large one;
    - ``roughness`` [m]: standard deviation of a wall about a line.
    """

    keyframes: int = 20
    voxel_deviations: float = 3.0
    least_voxel: float = 0.1
    greatest_voxel: float = 0.3
    line_ratio: float = 0.3
    roughness: float = 0.01

    def __post_init__(self) -> None:
        require_valid(self, shares=("line_ratio",))
        if self.greatest_voxel < self.least_voxel:
            raise ValueError(
                f"LocalMapSettings: greatest_voxel is {self.greatest_voxel}, must be at least {self.least_voxel}"
            )


@dataclass(frozen=True)
class MatchSettings:
    """Match a scan to surfels by Gauss-Newton.

    - ``iterations``: number of steps, at most;
    - ``first_reach`` [m]: distance within which a point seeks its surfel at first; each step multiplies it by
      ``shrink`` until it is ``reach_voxels`` voxels, within ``least_reach`` and ``greatest_reach`` [m];
    - ``outlier_deviations``: distance in standard deviations at which a point keeps a quarter of its weight.
    """

    iterations: int = 15
    first_reach: float = 0.5
    shrink: float = 0.7
    reach_voxels: float = 1.33
    least_reach: float = 0.2
    greatest_reach: float = 0.4
    outlier_deviations: float = 3.0

    def __post_init__(self) -> None:
        require_valid(self)
        if self.shrink >= 1.0:
            raise ValueError(f"MatchSettings: shrink is {self.shrink}, must be less than 1")


@dataclass(frozen=True)
class SearchSettings:
    """Search a scan in the local map by correlation, if the prediction is uncertain or the scan fits badly.

    - ``deviations``: half the window, in standard deviations of the prediction, within ``shift`` [m] and ``turn``
      [rad];
    - ``cell`` [m]: cell of the correlation; ``points``: points of the scan that it uses;
    - ``fewest_points``: smaller scans fit in many places and are not searched;
    - ``least_share``: a scan fits badly if fewer of its points find a surfel than this share of the usual number;
    - ``share_gain``: weight of a scan in the running mean that tells the usual number;
    - ``slip_gain``: the wheels have slipped if so many more of all points find a surfel at the place found.
    """

    deviations: float = 3.0
    shift: tuple[float, float] = (0.6, 3.0)
    turn: tuple[float, float] = (0.8, 1.0)
    cell: float = 0.2
    points: int = 200
    fewest_points: int = 60
    least_share: float = 0.75
    share_gain: float = 0.05
    slip_gain: float = 0.2

    def __post_init__(self) -> None:
        require_valid(self, shares=("least_share", "share_gain", "slip_gain"))
        require_ordered(self, "shift", "turn")


@dataclass(frozen=True)
class MotionSettings:
    """Predict the motion by odometry, with the noise model of Thrun, Burgard and Fox (2005), table 5.6.

    - ``rotation_from_rotation``, ``rotation_from_translation``, ``translation_from_translation``,
      ``translation_from_rotation``: standard deviations for one metre or one radian of motion, at level 1;
    - ``first_level``: level of the odometry's noise until ``window`` keyframes show the real one, which lies within
      ``least_level`` and ``greatest_level``;
    - ``largest_variance`` [m^2, rad^2]: a scan whose pose is less certain shows nothing of the odometry;
    - ``odometry``: False predicts a constant velocity instead, which changes by ``acceleration`` [m/s^2] and
      ``turn_acceleration`` [rad/s^2].
    """

    rotation_from_rotation: float = 0.005
    rotation_from_translation: float = 0.005
    translation_from_translation: float = 0.02
    translation_from_rotation: float = 0.01
    first_level: float = 2.0
    least_level: float = 0.7
    greatest_level: float = 20.0
    window: int = 40
    largest_variance: float = 1.0
    odometry: bool = True
    acceleration: float = 2.0
    turn_acceleration: float = 6.0

    def __post_init__(self) -> None:
        require_valid(self)
        if self.greatest_level < self.least_level:
            raise ValueError(
                f"MotionSettings: greatest_level is {self.greatest_level}, must be at least {self.least_level}"
            )


@dataclass(frozen=True)
class KeyframeSettings:
    """Add a keyframe after ``distance`` [m] or ``turn`` [rad], and link it to earlier ones.

    - ``links``: an edge leads to each keyframe that is so many keyframes back, at most ``longest_link`` [m] of path;
    - ``drift`` [m], ``yaw_drift`` [rad]: standard deviations that a metre of path adds to an edge, times the level
      of the odometry's noise; they stand for errors of the local map that all scans share.
    """

    distance: float = 0.3
    turn: float = 0.26
    links: tuple[int, ...] = (1, 5, 10, 19)
    longest_link: float = 6.0
    drift: float = 0.01
    yaw_drift: float = 0.003

    def __post_init__(self) -> None:
        require_valid(self)
        if 1 not in self.links:
            raise ValueError(f"KeyframeSettings: links is {self.links}, must hold 1: each keyframe follows another")


@dataclass(frozen=True)
class LoopSettings:
    """Search, accept and weigh loops.

    Candidates: every ``every`` [m], up to ``candidates`` keyframes that are ``least_way`` [m] of path ago or more, and
    within ``deviations`` standard deviations of the prediction plus ``nearby`` [m]. Compared are sub-maps of
    ``keyframes`` to either side, no farther than ``length`` [m] of path, but ``fewest`` at least.

    Search: correlation in cells of ``cell`` [m] over ``deviations`` standard deviations, within ``shift`` [m] and
    ``turn`` [rad]; ``peaks`` places that lie ``apart`` [m] or ``apart_turn`` [rad] from one another are refined.

    Acceptance, all at once: bounds of the measurements of ``LoopEvidence``, and a position whose standard deviation is
    at most ``max_position_deviation`` [m].

    Weight: ``information`` is the share of the points that count as independent; ``deviation`` [m] and
    ``yaw_deviation`` [rad], times the noise level of the odometry, are standard deviations of any loop. A loop keeps
    half of its weight at ``robust_deviations``, and is dropped if the solved graph contradicts it by more than
    ``greatest_chi_squared``. The graph is solved after ``solve_every`` new loops, or after ``solve_growth`` of those
    before if that is more: so a log with twice the loops is solved only a little more often.
    """

    enabled: bool = True
    every: float = 1.0
    least_way: float = 6.0
    deviations: float = 3.0
    nearby: float = 1.5
    candidates: int = 2
    keyframes: int = 8
    length: float = 2.6
    fewest: int = 3
    cell: float = 0.2
    shift: tuple[float, float] = (0.5, 5.0)
    turn: tuple[float, float] = (0.1, 0.6)
    peaks: int = 5
    apart: float = 0.8
    apart_turn: float = 0.17
    min_submap_overlap: float = 0.35
    min_agreement: float = 0.85
    max_runner_up: float = 0.93
    max_position_deviation: float = 0.5
    information: float = 0.05
    deviation: float = 0.02
    yaw_deviation: float = 0.004
    robust_deviations: float = 3.0
    greatest_chi_squared: float = 25.0
    solve_every: int = 5
    solve_growth: float = 0.2
    iterations: int = 10

    def __post_init__(self) -> None:
        require_valid(
            self,
            shares=("min_submap_overlap", "min_agreement", "information"),
            not_negative=("max_runner_up",),
        )
        require_ordered(self, "shift", "turn")


@dataclass(frozen=True)
class AdjustmentSettings:
    """Adjust keyframes and walls together.

    - ``rounds``: number of times that points are assigned to walls, each followed by ``steps`` of Gauss-Newton;
    - ``nodes``: number of unknown poses, at most; in a longer log each stands for several keyframes in a row, which
      bounds time and memory;
    - ``scans``: number of scans of a keyframe that take part;
    - ``scan_deviation`` [m], ``scan_yaw_deviation`` [rad]: standard deviations by which a single scan may leave its
      keyframe when all scans are registered to the finished map.
    """

    rounds: int = 12
    steps: int = 1
    nodes: int = 480
    scans: int = 3
    scan_deviation: float = 0.03
    scan_yaw_deviation: float = 0.01

    def __post_init__(self) -> None:
        require_valid(self, not_negative=("rounds",))


@dataclass(frozen=True)
class SessionSettings:
    """Join the logs of several robots, the poses of whose starts are known roughly.

    - ``deviation`` [m], ``yaw_deviation`` [rad]: standard deviations of the pose of a start;
    - ``way`` [m]: from one log to the next counts as a drive of this length.
    """

    deviation: float = 0.5
    yaw_deviation: float = 0.05
    way: float = 50.0

    def __post_init__(self) -> None:
        require_valid(self)


@dataclass(frozen=True)
class SlamSettings:
    """Settings of all steps of SLAM."""

    points: PointSettings = field(default_factory=PointSettings)
    local_map: LocalMapSettings = field(default_factory=LocalMapSettings)
    match: MatchSettings = field(default_factory=MatchSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    motion: MotionSettings = field(default_factory=MotionSettings)
    keyframes: KeyframeSettings = field(default_factory=KeyframeSettings)
    loops: LoopSettings = field(default_factory=LoopSettings)
    sessions: SessionSettings = field(default_factory=SessionSettings)
    adjustment: AdjustmentSettings = field(default_factory=AdjustmentSettings)
