"""Calibration of fits that never saw one family of worlds, or one kind of pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from mapquilt.benchmark.fitting import decide_again, fit_acceptance
from mapquilt.benchmark.world_split import shown_worlds
from mapquilt.evaluation.calibration import calibration
from mapquilt.evaluation.evaluated_pair import EvaluatedPair

Group = Literal["world", "subset"]


@dataclass(frozen=True)
class HeldOut:
    """Decisions about the ``pairs`` of one world or subset, by a fit on all others.

    ``ece`` and ``auc`` as in ``Calibration``; ``wrong_accepts`` of the ``accepted`` are wrong. All are None if the
    others cannot be fitted, because they are all right or all wrong.
    """

    group: Group
    name: str
    pairs: int
    accepted: int | None
    wrong_accepts: int | None
    ece: float | None
    auc: float | None


def hold_out_each(fitted_on: Sequence[EvaluatedPair], answered: Sequence[EvaluatedPair]) -> list[HeldOut]:
    """Repeat the fit without each world, then without each subset, and check it on the answers of that; worst first.

    ``fitted_on`` are the pairs of the fit, ``answered`` all pairs. The worst has the largest calibration error. A pair
    that shows two worlds is left out with either. The answer to a distorted pair counts as right at the right place,
    because its truth is not exact enough for more; others without a reliable truth are not counted.
    """
    return [
        *_each("world", [_worlds(fitted_on, answered), _worlds(answered, answered)], fitted_on, answered),
        *_each("subset", [_subsets(fitted_on), _subsets(answered)], fitted_on, answered),
    ]


def _worlds(pairs: Sequence[EvaluatedPair], every: Sequence[EvaluatedPair]) -> list[frozenset[str]]:
    return shown_worlds([one.pair for one in (*pairs, *every)])[: len(pairs)]


def _subsets(pairs: Sequence[EvaluatedPair]) -> list[frozenset[str]]:
    return [frozenset({one.pair.subset} if one.pair.subset else ()) for one in pairs]


def _each(
    group: Group,
    names: Sequence[list[frozenset[str]]],
    fitted_on: Sequence[EvaluatedPair],
    answered: Sequence[EvaluatedPair],
) -> list[HeldOut]:
    rows = []
    for name in sorted(frozenset().union(*names[1])):
        others = [one for one, has in zip(fitted_on, names[0], strict=True) if name not in has]
        those = [one for one, has in zip(answered, names[1], strict=True) if name in has]
        rows.append(_held_out(group, name, others, [_leniently(one) for one in those]))
    return sorted((row for row in rows if row.pairs), key=lambda row: (-1.0 if row.ece is None else -row.ece, row.name))


def _leniently(one: EvaluatedPair) -> EvaluatedPair:
    return replace(one, right=one.right_place, distorted=False) if one.distorted else one


def _held_out(group: Group, name: str, others: Sequence[EvaluatedPair], those: Sequence[EvaluatedPair]) -> HeldOut:
    judged = [one for one in those if one.reliable and one.confidence is not None]
    try:
        settings = fit_acceptance(others)
    except ValueError:
        return HeldOut(group, name, len(judged), None, None, None, None)
    decided = decide_again(judged, settings)
    found = calibration(decided)
    accepted = [one for one in decided if one.accepted]
    return HeldOut(
        group,
        name,
        len(judged),
        len(accepted),
        sum(not one.right for one in accepted),
        None if found is None else found.ece,
        None if found is None else found.auc,
    )
