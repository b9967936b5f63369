"""Search for the second best transform, which decides if an answer is unambiguous."""

from __future__ import annotations

import math

from mapping.geometry.similarity2 import Similarity2
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.correlation import CorrelationSettings, correlate
from merge.records.proposal import Proposal

SECOND_BEST = CorrelationSettings(peaks=6)


def second_best_proposals(
    target: PreparedMap, source: PreparedMap, answer: Similarity2, settings: CorrelationSettings = SECOND_BEST
) -> list[Proposal]:
    """Propose the best other shifts at the scale and yaw of an answer, and rotated by 90, 180 and 270 degrees.

    The next room of a row, the other wing and the other end of a symmetric hall are there. Repetitions of either map
    are peaks of the correlation, whatever method found the answer. The best proposal comes first.
    """
    yaws = [answer.yaw + math.radians(turn) for turn in (0.0, 90.0, 180.0, 270.0)]
    peaks = correlate(target.layers, source.layers, answer.scale, yaws, settings)
    return [Proposal(peak.target_from_source) for peak in sorted(peaks, key=lambda peak: -peak.score)]
