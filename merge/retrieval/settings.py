"""Settings of the retrieval of maps that show the same place."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from mapping.validation import require_valid


@dataclass(frozen=True)
class PatchSettings:
    """Patches of a map, each in the frame of a wall: along the wall, and into the free space.

    - ``spacing`` [m]: one patch for every square of this side in which walls face one of eight directions;
    - ``most``: patches of a map, evenly chosen; a map of 20 x 20 m has 200 to 300;
    - ``half_width``, ``depth``, ``behind`` [m]: extent of a patch to either side, in front of the wall and behind it.
      Larger patches hold more that only one of two maps saw: of half again the size, 5 % fewer true neighbours are
      among the first five;
    - ``step`` [m]: distance of samples;
    - ``blur`` [m]: standard deviation of the Gaussian before them, more than drift within a patch;
    - ``wall_weight``: weight of walls against free space; walls cover fewer cells;
    - ``waves``: cosine waves of either picture whose numbers along and across add up to less than this.
    """

    spacing: float = 0.5
    most: int = 300
    half_width: float = 1.8
    depth: float = 2.4
    behind: float = 0.6
    step: float = 0.3
    blur: float = 0.3
    wall_weight: float = 2.0
    waves: int = 6

    def __post_init__(self) -> None:
        require_valid(self)


@dataclass(frozen=True)
class RetrievalSettings:
    """Retrieval of maps that show the same place.

    - ``patches``: the description of a map;
    - ``tree_waves``: waves of largest variance by which the k-d tree finds similar patches. More make it slow;
    - ``similar``: similar patches that each patch is compared with;
    - ``nearest``: of these so many of other maps vote, by all waves;
    - ``turn_bin`` [rad], ``shift_bin`` [m]: votes for one relative pose agree within about this;
    - ``least_votes``: a pose is suggested by patches whose weights, at most 1 each, add up to this;
    - ``poses_per_pair``: at most so many.
    """

    patches: PatchSettings = field(default_factory=PatchSettings)
    tree_waves: int = 8
    similar: int = 40
    nearest: int = 16
    turn_bin: float = math.radians(12.0)
    shift_bin: float = 0.7
    least_votes: float = 0.5
    poses_per_pair: int = 3

    def __post_init__(self) -> None:
        require_valid(self)
