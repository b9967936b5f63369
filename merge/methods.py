"""The methods of proposing transforms, by name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from merge.baselines.genetic import Genetic
from merge.baselines.hough import Hough
from merge.baselines.icp import Icp
from merge.baselines.plain_orb import PlainOrb
from merge.baselines.random_walk import RandomWalk
from merge.baselines.stitching import Stitching
from merge.facing import Facing
from merge.landmarks import Landmarks
from merge.morphology.method import Morphology
from merge.orb import Orb
from merge.proposer import Proposer
from merge.published import Published
from merge.sift import Sift

PROPOSERS: Mapping[str, tuple[Proposer[Any], ...]] = MappingProxyType(
    {
        "quilt": (Orb(), Landmarks(), Facing()),
        "sift": (Sift(),),
        "sift_orb": (Sift("orb"),),
        "morphology": (Morphology(),),
        "orb": (PlainOrb(),),
        "stitching": (Stitching(),),
        "hough": (Hough(),),
        "random_walk": (RandomWalk(),),
        "genetic": (Genetic(),),
        "icp": (Icp(),),
    }
)
"""What each method proposes with, one after the other, until an answer is sure."""

PUBLISHED: Mapping[str, Published[Any]] = MappingProxyType(
    {
        "sift": Sift.as_published(),
        "sift_orb": Sift.as_published("orb"),
        "morphology": Morphology(),
        "orb": PlainOrb(),
        "stitching": Stitching(),
        "hough": Hough(),
        "random_walk": RandomWalk(),
        "genetic": Genetic(),
        "icp": Icp(),
    }
)
"""Those that come with an answer and a rule of acceptance of their own; each is a proposer too."""
