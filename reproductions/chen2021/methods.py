"""Methods of the reproduction: the two pipelines, their variants, and the project's own method."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import get_args

from mapping.geometry.scale_range import ScaleRange
from merge.literature.chen2021.correction import CorrectionSettings, Step
from merge.literature.chen2021.morphology import Morphology
from merge.literature.chen2021.sift import Sift
from merge.settings import MergeSettings, ProposerSettings

SCALE = ScaleRange.free()
"""The thesis estimates a similarity with scale, whatever cells the maps state."""

RUNS = 5
"""Runs of RANSAC on each pair of maps."""

PLAIN, ORB, CORRECTED, OURS = "SIFT", "ORB", "correction", "quilt"
FAST_BRISK = "FAST and BRISK"
PLAIN_VERIFIED, CORRECTED_VERIFIED = "SIFT, verified", "correction, verified"
ALL_GREYS, TWO_GREYS = "SIFT, all greys", "SIFT, two greys"
CONSENSUS, ICP = "consensus", "ICP"
PARTS = (*get_args(Step), CONSENSUS, ICP)
"""Parts of the correction that are left out one at a time."""


def without(part: str) -> str:
    return f"without {part}"


@dataclass(frozen=True)
class StudyMethod:
    """Settings of a merge, and the number of its runs on each pair: 1 if nothing in it is random."""

    settings: MergeSettings
    runs: int = 1


def _sift(sift: Sift) -> StudyMethod:
    proposers = ProposerSettings(sift_as_published=sift)
    return StudyMethod(MergeSettings("sift", SCALE, as_published=True, proposers=proposers), RUNS)


def _morphology(method: Morphology, runs: int = 1) -> StudyMethod:
    proposers = ProposerSettings(morphology=method)
    return StudyMethod(MergeSettings("morphology", SCALE, as_published=True, proposers=proposers), runs)


METHODS: Mapping[str, StudyMethod] = MappingProxyType(
    {
        PLAIN: _sift(Sift.as_published()),
        ORB: _sift(Sift.as_published("orb")),
        CORRECTED: _morphology(Morphology()),
        OURS: StudyMethod(MergeSettings("quilt", SCALE)),
        FAST_BRISK: _sift(Sift.as_published("fast_brisk")),
        PLAIN_VERIFIED: StudyMethod(MergeSettings("sift", SCALE)),
        CORRECTED_VERIFIED: StudyMethod(MergeSettings("morphology", SCALE)),
        ALL_GREYS: _sift(Sift.as_published(greys="all")),
        TWO_GREYS: _sift(Sift.as_published(greys="two")),
        **{
            without(step): _morphology(Morphology(correction=CorrectionSettings(without=step)))
            for step in get_args(Step)
        },
        without(CONSENSUS): _morphology(Morphology(without="consensus"), RUNS),
        without(ICP): _morphology(Morphology(without="icp")),
    }
)
"""As published but for ``quilt`` and the ``verified`` ones, which the merger verifies and accepts."""

_COMPARED = (PLAIN, ORB, CORRECTED, OURS)
_CASE = (*_COMPARED, FAST_BRISK, PLAIN_VERIFIED, CORRECTED_VERIFIED)
GROUPS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"ablation": _COMPARED, "case": _CASE, "sets": tuple(METHODS), "floor": _CASE}
)
"""Methods of each group of trials."""
