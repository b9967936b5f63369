"""The methods of proposing transforms, by name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from merge.literature.chen2021.morphology import Morphology
from merge.literature.chen2021.sift import Sift
from merge.literature.genetic import Genetic
from merge.literature.hough import Hough
from merge.literature.icp import Icp
from merge.literature.plain_orb import PlainOrb
from merge.literature.published import Published
from merge.literature.random_walk import RandomWalk
from merge.literature.stitching import Stitching
from merge.proposers.landmarks import Landmarks
from merge.proposers.normal_correlation import NormalCorrelation
from merge.proposers.orb import Orb
from merge.proposers.proposer import Proposer

PROPOSERS: Mapping[str, tuple[Proposer[Any], ...]] = MappingProxyType(
    {
        "quilt": (Orb(), Landmarks(), NormalCorrelation()),
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
