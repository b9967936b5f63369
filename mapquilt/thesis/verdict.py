"""Where the correction helps and where it does not, in words that follow from the counts."""

from __future__ import annotations

from collections.abc import Sequence

from mapquilt.thesis.tally import CaseTally

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


def _why(plain: CaseTally, corrected: CaseTally) -> str:
    most = plain.right.of
    if corrected.right.count > plain.right.count:
        return "Corners outlast what changes the descriptors, and ICP settles what they leave" + _errors(
            plain, corrected
        )
    if plain.right.count == most and corrected.right.count == most:
        return "Both are always right; what the correction still gains is in the error" + _errors(plain, corrected)
    if max(plain.right.count, corrected.right.count) <= 0.2 * most:
        return _both_fail(corrected)
    return (
        "SIFT's descriptors see more than corners do here: the greys about a wall, free on one side and unknown on the "
        "other, which the binarisation throws away; and of four quarter turns the greatest index need not be the right "
        "one" + _errors(plain, corrected)
    )


def _both_fail(corrected: CaseTally) -> str:
    index, true_index = corrected.index, corrected.true_index
    said = ""
    if index is not None and true_index is not None and index >= true_index:
        said = (
            f" The index cannot help: at wrong answers it is {index:.3f}, at the truth {true_index:.3f}"
            ", since free on free cells dominate it."
        )
    return "Neither is of use: too little of the walls is common or left to find corners on." + said


def _errors(plain: CaseTally, corrected: CaseTally) -> str:
    if plain.displacement_cells is None or corrected.displacement_cells is None:
        return "."
    return f" (median {corrected.displacement_cells:.1f} cells against {plain.displacement_cells:.1f})."
