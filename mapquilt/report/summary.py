"""First lines of a report: the headline and the numbers of each method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.wording import counted
from mapquilt.evaluation.aggregation import error_quantiles, outcome_counts
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.formatting import false_accept_text, number_text, share_text
from mapquilt.evaluation.statistics import Quantiles, Share
from mapquilt.report.content import Content, Sheet, methods_of


@dataclass(frozen=True)
class Tile:
    """A number and its meaning; ``tone`` is good, bad or empty."""

    value: str
    words: str
    tone: str = ""


@dataclass(frozen=True)
class _Summary:
    """Numbers of one method; ``true_accepts`` is None without a pair that has exactly one right answer."""

    pairs: int
    true_accepts: Share | None
    false_accepts: Share
    false_rejects: int
    displacement: Quantiles | None
    seconds: float | None


def _summary(answers: Sequence[EvaluatedPair], method: str) -> _Summary:
    here = [one for one in answers if one.method == method]
    hits = [one.outcome == "true accept" for one in here if one.identifiable]
    seconds = [one.seconds for one in here if one.seconds is not None]
    return _Summary(
        pairs=len(here),
        true_accepts=Share.counted(hits) if hits else None,
        false_accepts=Share.counted([one.outcome == "false accept" for one in here]),
        false_rejects=outcome_counts(here)["false_rejects"],
        displacement=error_quantiles([one for one in here if one.accepted])["displacement_m"],
        seconds=float(np.median(seconds)) if seconds else None,
    )


def headline(content: Content) -> str:
    """Write one sentence on the first method."""
    methods = methods_of(content.answers)
    if not methods:
        one = sum(answer.identifiable for answer in content.answers)
        none = sum(answer.negative for answer in content.answers)
        return (
            f"{counted(len(content.answers), 'pair')} of maps with known truth: {one} with exactly one placement that "
            f"fits, {len(content.answers) - one - none} with several, and {none} with nothing in common. "
            "None is merged yet."
        )
    found, method = _summary(content.answers, methods[0]), methods[0]
    wrong = f"{counted(found.false_accepts.count, 'false accept')} among {counted(found.pairs, 'pair')}"
    share = found.true_accepts
    if share is None:
        return f"No pair here has exactly one right answer; {method} made {wrong}."
    low, high = 100 * share.interval.low, 100 * share.interval.high
    return (
        f"{method} found and accepted the right transform of {share.count} of {share.of} pairs with one right answer "
        f"({100 * share.value:.0f} %, 95 % interval {low:.0f} to {high:.0f} %), and made {wrong}."
    )


def tiles(content: Content) -> list[Tile]:
    """Show the main numbers of the first method."""
    methods = methods_of(content.answers)
    pairs = len({(one.pair.title, one.pair.level) for one in content.answers})
    shown = [Tile(f"{pairs:,}", "pairs of maps")]
    if not methods:
        answers = content.answers
        shown.append(Tile(str(sum(one.identifiable for one in answers)), "with exactly one right answer", "good"))
        shown.append(Tile(str(sum(one.negative for one in answers)), "with nothing in common"))
        overlaps = [one.truth.overlap for one in answers if one.truth.overlap and not one.negative]
        if overlaps:
            shown.append(Tile(f"{100 * float(np.median(overlaps)):.0f} %", "median true overlap of the others"))
        return shown
    found = _summary(content.answers, methods[0])
    if found.true_accepts is not None:
        share = found.true_accepts
        shown.append(Tile(f"{100 * share.value:.0f} %", f"true accepts, of {share.of} with one right answer", "good"))
    wrong = found.false_accepts.count
    shown.append(Tile(str(wrong), "false accepts", "bad" if wrong else "good"))
    shown.append(Tile(str(found.false_rejects), "false rejects"))
    if found.displacement is not None:
        shown.append(Tile(f"{100 * found.displacement.median:.1f} cm", "median displacement of accepted answers"))
    if found.seconds is not None:
        shown.append(Tile(f"{found.seconds:.2f} s", "median processor time of a pair"))
    return shown


def method_sheet(answers: tuple[EvaluatedPair, ...]) -> Sheet | None:
    """Tabulate the numbers of each method; None if nothing was merged."""
    methods = methods_of(answers)
    if not methods:
        return None
    names = ("pairs", "true accepts [%]", "false accepts", "false rejects", "median [m]", "90 % [m]", "s a pair")
    caption = (
        "True accepts and false rejects are counted of the pairs with exactly one right answer, whose number is in the "
        "row, with Wilson's 95 % interval; false accepts of all pairs, with the upper end of theirs in per cent. "
        "Displacements are those of accepted answers."
    )
    rows = [_row(method, _summary(answers, method)) for method in methods]
    return Sheet("Methods", caption, [("method", False), *((name, True) for name in names)], rows)


def _row(method: str, found: _Summary) -> list[str]:
    return [
        method,
        str(found.pairs),
        "-" if found.true_accepts is None else f"{share_text(found.true_accepts)} of {found.true_accepts.of}",
        false_accept_text(found.false_accepts),
        str(found.false_rejects),
        number_text(None if found.displacement is None else found.displacement.median, 3),
        number_text(None if found.displacement is None else found.displacement.p90, 3),
        number_text(found.seconds, 2),
    ]
