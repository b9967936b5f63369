"""Where the correction helps and where it does not, in words that follow from the counts."""

from __future__ import annotations

from collections.abc import Sequence

from reproductions.chen2021.tally import CaseTally

PLAIN, CORRECTED = "sift as published", "morphology as published"


def compared(counted: Sequence[CaseTally], case: str) -> tuple[CaseTally, CaseTally] | None:
    """The tallies of the two pipelines as published in a case; None where one did not run."""
    found = {one.method: one for one in counted if one.case.name == case}
    return (found[PLAIN], found[CORRECTED]) if {PLAIN, CORRECTED} <= found.keys() else None


def verdict(plain: CaseTally, corrected: CaseTally) -> str:
    """Which of the two pipelines is ahead; apart where Wilson's intervals have nothing in common."""
    if corrected.right.count == plain.right.count:
        return "level"
    better, worse = (corrected, plain) if corrected.right.count > plain.right.count else (plain, corrected)
    name = "the correction" if better is corrected else "plain SIFT"
    clear = better.right.interval.low > worse.right.interval.high
    return f"{name} is ahead" if clear else f"{name} is ahead, within the intervals"


def remark(plain: CaseTally, corrected: CaseTally) -> str:
    """One line on a case: the verdict, and why."""
    told = f"{verdict(plain, corrected)} ({corrected.right.count} against {plain.right.count} of {plain.right.of})"
    return f"**{plain.case.name}**: {told}. {_why(plain, corrected)}"


LITTLE_OVERLAP, OF_LITTLE_USE = 0.25, 0.2


def _why(plain: CaseTally, corrected: CaseTally) -> str:
    most = plain.right.of
    if max(plain.right.count, corrected.right.count) <= OF_LITTLE_USE * most:
        return _both_fail(corrected)
    errors = _errors(plain, corrected)
    if corrected.case.team:
        return f"One wrong pair spoils the chain through the third robot's map{errors}."
    if plain.right.count == corrected.right.count == most:
        return f"SIFT finds enough on maps this clean; what the correction gains is in the error{errors}."
    missed = [_missed(name, one) for name, one in (("SIFT", plain), ("the correction", corrected))]
    return f"{'. '.join(told for told in missed if told)}. Of the right answers the error differs{errors}."


def _missed(name: str, one: CaseTally) -> str:
    """What became of the answers that are not right; empty where all are."""
    rest = one.right.of - one.right.count - one.nearly - one.collapsed
    kinds = (
        (one.nearly, "at the right place but not exactly enough"),
        (one.collapsed, "shrunk to less than half, where everything is an inlier"),
        (rest, "elsewhere"),
    )
    told = [f"{count} {kind}" for count, kind in kinds if count]
    return f"Wrong answers of {name}: {', '.join(told)}" if told else ""


def _both_fail(corrected: CaseTally) -> str:
    if corrected.overlap is not None and corrected.overlap < LITTLE_OVERLAP:
        common = f"The maps have {100 * corrected.overlap:.0f} % in common, and their wings look alike"
    elif corrected.case.team:
        common = "One wrong pair spoils the chain through the third robot's map"
    else:
        common = "The noise leaves no wall to find a corner on"
    return f"{common}.{_index_told(corrected)}"


def _index_told(corrected: CaseTally) -> str:
    if corrected.index is None or corrected.true_index is None:
        return ""
    return (
        f" The index says little: {corrected.index:.3f} at the answers, {corrected.true_index:.3f} at the truth, since "
        "free on free cells dominate it."
    )


def _errors(plain: CaseTally, corrected: CaseTally) -> str:
    if plain.displacement_cells is None or corrected.displacement_cells is None:
        return ""
    return f" (median {corrected.displacement_cells:.1f} cells against {plain.displacement_cells:.1f})"
