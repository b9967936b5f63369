"""Shares, errors and numbers as short texts for tables."""

from __future__ import annotations

from collections.abc import Iterable

from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.statistics import Interval, Share


def outcome_text(one: EvaluatedPair) -> str:
    """Name the outcome; beside a wrong verdict, say if the pair is distorted, ambiguous or without common ground."""
    words: list[str] = [one.outcome or "-"]
    if one.outcome in ("false accept", "false reject"):
        words += ["distorted"] if one.distorted else []
        words += ["no common ground"] if one.negative else [] if one.identifiable else ["ambiguous"]
    return ", ".join(words)


def outcome_notes(pairs: Iterable[EvaluatedPair]) -> tuple[str, ...]:
    """Explain the words that ``outcome_text`` puts beside the outcomes of these pairs."""
    used = {word for one in pairs for word in outcome_text(one).split(", ")[1:]}
    return tuple(f"{word}: {meaning}" for word, meaning in _MEANINGS.items() if word in used)


_MEANINGS = {
    "distorted": "no transform fits these maps well, so that a right answer may miss by chance",
    "ambiguous": "several placements fit these maps, and nothing in them tells which is right",
    "no common ground": "the maps show no place that both robots saw, and had to be refused",
}


def error_texts(one: EvaluatedPair) -> tuple[str, str, str, str]:
    """Format rotation [degrees], scale [%] and displacement [m, cells]; dashes for None."""
    error = one.error
    if error is None:
        return "-", "-", "-", "-"
    return (
        number_text(error.rotation_deg, 2),
        number_text(error.scale_percent, 2),
        number_text(error.displacement_m, 3),
        number_text(error.displacement_cells, 1),
    )


def number_text(value: float | None, places: int) -> str:
    """Format a number; a dash for None."""
    return "-" if value is None else f"{value:.{places}f}"


def share_text(share: Share | None, clustered: Interval | None = None) -> str:
    """Format a share in per cent with its interval, such as ``95.0 (83.5 to 98.6)``, and that over clusters."""
    if share is None:
        return "-"
    text = f"{100 * share.value:.1f} ({_interval_text(share.interval)})"
    return text if clustered is None else f"{text} [{_interval_text(clustered)}]"


def false_accept_text(share: Share | None, clustered: Interval | None = None) -> str:
    """Format a count with the upper end of the interval of its share in per cent, such as ``0 (up to 8.8)``."""
    if share is None:
        return "-"
    text = f"{share.count} (up to {100 * share.interval.high:.1f})"
    return text if clustered is None else f"{text} [{_interval_text(clustered)}]"


def _interval_text(interval: Interval) -> str:
    return f"{100 * interval.low:.1f} to {100 * interval.high:.1f}"
