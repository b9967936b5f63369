"""Other places that would look as good as an answer, searched for on purpose."""

from __future__ import annotations

import math

from mapping.geometry.similarity2 import Similarity2
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.correlation import correlate
from merge.records.proposal import Proposal

PEAKS = 6


def second_best_proposals(target: PreparedMap, source: PreparedMap, answer: Similarity2) -> list[Proposal]:
    """The best other shifts at the answer's own scale and rotation, and turned by 90, 180 and 270 degrees, best first.

    The next room of a row, the other wing and the other end of a symmetric hall lie there: what repeats in either map
    comes up as a peak, whatever method the answer came from.
    """
    yaws = [answer.yaw + math.radians(turn) for turn in (0.0, 90.0, 180.0, 270.0)]
    peaks = correlate(target.layers, source.layers, answer.scale, yaws, most=PEAKS)
    return [Proposal(peak.target_from_source) for peak in sorted(peaks, key=lambda peak: -peak.score)]
