"""Settings of the particle filter, one class for each step."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Literal, get_args

from mapping.validation import require_valid

Proposal = Literal["maximum", "gaussian"]
PROPOSALS: tuple[Proposal, ...] = get_args(Proposal)


@dataclass(frozen=True)
class MotionNoise:
    """Odometry error that particles are drawn with (Probabilistic Robotics, table 5.6).

    Standard deviations for one metre or one radian between two updates: ``rotation_from_rotation`` [rad/rad],
    ``rotation_from_translation`` [rad/m], ``translation_from_translation`` [m/m], ``translation_from_rotation``
    [m/rad]. They cover a robot of noise level 3; gmapping's own, 0.1 and 0.2, spread the particles farther than
    the scan matcher brings them back.

    Raises ``ValueError`` naming the field and the value.
    """

    rotation_from_rotation: float = 0.05
    rotation_from_translation: float = 0.02
    translation_from_translation: float = 0.05
    translation_from_rotation: float = 0.02

    def __post_init__(self) -> None:
        require_valid(self, not_negative=tuple(each.name for each in fields(self)))


@dataclass(frozen=True)
class MatchSettings:
    """Match a scan with a map: the likelihood of the beams' endpoints, and the hill climbing to its maximum.

    - ``most_beams``: at most this number of beams, evenly spaced, are compared;
    - ``deviation`` [m]: standard deviation of an endpoint about the nearest wall, that of a usual lidar at 8 m;
    - ``outliers``: likelihood of an endpoint far from any wall, relative to one on a wall;
    - ``least_hits``: a cell is a wall if more than this share of its visits were hits; higher than in the final map,
      so that the cells beside a wall do not blur it;
    - ``first_step`` [m], ``first_turn`` [rad], ``halvings``: steps of the hill climbing, halved that often (gmapping:
      0.05, 0.05 and 5).

    Raises ``ValueError`` naming the field and the value.
    """

    most_beams: int = 180
    deviation: float = 0.05
    outliers: float = 0.1
    least_hits: float = 0.33
    first_step: float = 0.05
    first_turn: float = 0.05
    halvings: int = 5

    def __post_init__(self) -> None:
        require_valid(self, shares=("least_hits",))


@dataclass(frozen=True)
class GaussianSettings:
    """Sample the proposal "gaussian" around the maximum of the likelihood (Grisetti et al. 2007, section III).

    - ``spacing`` [m], ``yaw_spacing`` [rad]: the 27 sampled poses lie this far apart in x, y and yaw;
    - ``beams_per_reading``: so many beams count as one independent reading, since neighbours err alike;
    - ``least_motion`` [m], ``least_turn`` [rad]: standard deviations added to those of the motion, since a turn on the
      spot has none in x and y.

    Raises ``ValueError`` naming the field and the value.
    """

    spacing: float = 0.015
    yaw_spacing: float = 0.006
    beams_per_reading: float = 3.0
    least_motion: float = 0.01
    least_turn: float = 0.001

    def __post_init__(self) -> None:
        require_valid(self)


@dataclass(frozen=True)
class ParticleSettings:
    """Map with a Rao-Blackwellised particle filter.

    - ``particles``: number of hypotheses, as gmapping ships it;
    - ``update_distance`` [m], ``update_angle`` [rad]: process a scan after so much motion (gmapping: 1.0 and 0.5, often
      set to 0.5 and 0.5);
    - ``proposal``: draw poses at the ``maximum`` of the likelihood, as gmapping does, or from a ``gaussian`` around it;
    - ``weight_smoothing``: log-likelihoods are divided by it before they become weights, since the beams of a scan are
      not independent (gmapping: 3 times the number of particles);
    - ``resample_below``: resample if the effective sample size falls below this share of the particles.

    Raises ``ValueError`` naming the field and the value.
    """

    particles: int = 30
    update_distance: float = 0.5
    update_angle: float = 0.5
    proposal: Proposal = "maximum"
    weight_smoothing: float = 90.0
    resample_below: float = 0.5
    motion: MotionNoise = field(default_factory=MotionNoise)
    matching: MatchSettings = field(default_factory=MatchSettings)
    gaussian: GaussianSettings = field(default_factory=GaussianSettings)

    def __post_init__(self) -> None:
        require_valid(self, shares=("resample_below",))
        if self.proposal not in PROPOSALS:
            raise ValueError(f"ParticleSettings: proposal is {self.proposal!r}, must be one of {', '.join(PROPOSALS)}")
