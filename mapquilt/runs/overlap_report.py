"""What overlap the maps of a run have, and whether it is what was wanted."""

from __future__ import annotations

from dataclasses import dataclass

from mapquilt.runs.sample import Sample


@dataclass(frozen=True)
class OverlapTold:
    """One line for the user, and warnings where the range was missed."""

    line: str
    warnings: tuple[str, ...]


def true_overlaps(sample: Sample) -> dict[tuple[str, str], float]:
    """The true overlap of each pair of maps of different robots, by their names."""
    robot = {place.name: place.robot for place in sample.places.maps}
    return {pair: each.overlap for pair, each in sample.places.pairs.items() if robot[pair[0]] != robot[pair[1]]}


def overlap_told(sample: Sample, wanted: tuple[float, float]) -> OverlapTold:
    """How the overlaps of a sample compare with those wanted, least and greatest."""
    overlaps = true_overlaps(sample)
    seconds = [place.truth.trajectory.stamps[-1] for place in sample.places.maps]
    line = (
        f"true overlap {min(overlaps.values()):.3f} to {max(overlaps.values()):.3f}, wanted {wanted[0]:g} to "
        f"{wanted[1]:g}; missions cut to {', '.join(f'{end:.0f}' for end in seconds)} s"
    )
    warnings = tuple(
        f"overlap {wanted[0]:g}:{wanted[1]:g} was not reached: {a} and {b} overlap by {overlap:.3f}, the nearest found"
        for (a, b), overlap in overlaps.items()
        if not wanted[0] <= overlap <= wanted[1]
    )
    return OverlapTold(line, warnings)
