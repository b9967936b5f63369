"""Counts, shares, errors and times of a group of evaluated pairs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from mapquilt.evaluation.evaluated_pair import OUTCOMES, EvaluatedPair
from mapquilt.evaluation.statistics import Interval, Quantiles, Share, mean_over_clusters
from mapquilt.evaluation.transform_error import TransformError

ERRORS = tuple(field.name for field in fields(TransformError))


@dataclass(frozen=True)
class Aggregate:
    """Results of one method on a group of pairs; None if there is nothing to count.

    - ``pairs``: all pairs of the group; ``asked``: those whose transform should be found;
    - ``distorted``: of the asked ones, those whose truth is not reliable (``EvaluatedPair.reliable``);
    - ``right``, ``true_accepts``: shares of the asked pairs; ``false_accepts``: share of all;
    - ``accepted_right``: share of right answers among those that were accepted, the precision;
    - ``clustered``: intervals of these shares by a bootstrap over clusters of dependent pairs (``PairInfo.cluster``);
      empty if a pair has no cluster;
    - ``errors_right``, ``errors_accepted``: by name of the error, over right and over accepted answers to asked pairs;
    - ``acceptance_index``: median over answers to asked pairs (Birk and Carpin 2006).
    """

    pairs: int
    asked: int
    distorted: int
    right: Share | None
    true_accepts: Share | None
    false_accepts: Share | None
    accepted_right: Share | None
    clustered: dict[str, Interval]
    errors_right: dict[str, Quantiles | None]
    errors_accepted: dict[str, Quantiles | None]
    acceptance_index: float | None


def aggregate(
    pairs: Sequence[EvaluatedPair], asked: Sequence[EvaluatedPair], new_rng: Callable[[], np.random.Generator]
) -> Aggregate:
    """Aggregate one method's answers to ``pairs``; ``asked`` are those whose transform should be found.

    Each bootstrap starts from a fresh generator, so that one share's interval does not depend on the others.
    """
    accepted = [one for one in pairs if one.accepted]
    flags = {
        "right": (asked, [one.right for one in asked]),
        "true_accepts": (asked, [one.outcome == "true accept" for one in asked]),
        "false_accepts": (pairs, [one.outcome == "false accept" for one in pairs]),
        "accepted_right": (accepted, [one.right for one in accepted]),
    }
    shares = {name: Share.counted(hits) if hits else None for name, (_, hits) in flags.items()}
    intervals = {name: _clustered(group, hits, new_rng) for name, (group, hits) in flags.items()}
    indices = [one.evidence.acceptance_index for one in asked if one.evidence is not None]
    known = [index for index in indices if index is not None]
    return Aggregate(
        pairs=len(pairs),
        asked=len(asked),
        distorted=sum(not one.reliable for one in asked),
        right=shares["right"],
        true_accepts=shares["true_accepts"],
        false_accepts=shares["false_accepts"],
        accepted_right=shares["accepted_right"],
        clustered={name: interval for name, interval in intervals.items() if interval is not None},
        errors_right=error_quantiles([one for one in asked if one.right]),
        errors_accepted=error_quantiles([one for one in asked if one.accepted]),
        acceptance_index=float(np.median(known)) if known else None,
    )


def _clustered(
    pairs: Sequence[EvaluatedPair], hits: Sequence[bool], new_rng: Callable[[], np.random.Generator]
) -> Interval | None:
    clusters = [one.pair.cluster for one in pairs]
    number = len(set(clusters))
    if None in clusters or number < 2:
        return None
    if all(hits) or not any(hits):  # the bootstrap cannot extrapolate: count each cluster once
        return Share.counted([hits[0]] * number).interval
    return mean_over_clusters(hits, clusters, new_rng())


def error_quantiles(pairs: Sequence[EvaluatedPair]) -> dict[str, Quantiles | None]:
    """Take median and 90th percentile of each error, by the names of ``TransformError``."""
    found: dict[str, Quantiles | None] = {}
    for name in ERRORS:
        values = [getattr(one.error, name) for one in pairs if one.error is not None]
        known = [value for value in values if value is not None]
        found[name] = Quantiles.of(known) if known else None
    return found


def outcome_counts(pairs: Sequence[EvaluatedPair]) -> dict[str, int]:
    """Count each outcome, by names such as ``false_accepts``."""
    counts = Counter[str](one.outcome or "" for one in pairs)
    return {f"{outcome.replace(' ', '_')}s": counts[outcome] for outcome in OUTCOMES}
