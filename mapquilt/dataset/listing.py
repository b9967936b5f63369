"""Pairs of a data set, filtered and listed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from mapping.numbers import parse_range
from mapping.wording import counted, did_you_mean
from mapquilt.dataset.manifest import Manifest, require_split
from mapquilt.viz.text_table import plain_table


@dataclass(frozen=True)
class PairFilter:
    """Select pairs; None selects all. Overlap must lie between ``low`` and ``high``, both included."""

    split: str | None = None
    world: str | None = None
    low: float = 0.0
    high: float = 1.0
    noise: float | None = None
    identifiable: bool | None = None

    @staticmethod
    def parse(
        split: str | None, world: str | None, overlap: str, noise: float | None, identifiable: bool | None
    ) -> PairFilter:
        """Build a filter from options. Raises ``ValueError`` if ``overlap`` is not LO:HI within 0 to 1."""
        try:
            bounds = parse_range(overlap)
        except ValueError:
            raise ValueError(f"--overlap {overlap}: must be LO:HI such as 0.3:0.6") from None
        if not 0.0 <= bounds[0] <= bounds[1] <= 1.0:
            raise ValueError(f"--overlap {overlap}: must lie within 0:1, the lower bound first")
        return PairFilter(split, world, *bounds, noise, identifiable)

    def require_present(self, folder: Path, manifest: Manifest) -> None:
        """Raise ``ValueError`` naming the folder if no sample has the split, world or noise that is asked for."""
        if self.split is not None:
            require_split(folder, manifest, self.split)
        worlds = sorted({str(sample["world"]) for sample in manifest.samples})
        if self.world is not None and self.world not in worlds:
            near = did_you_mean(self.world, worlds)
            raise ValueError(f"{folder}: has no world {self.world!r}, only {', '.join(worlds)}{near}")
        levels = sorted({float(sample["settings"]["noise"]) for sample in manifest.samples})
        if self.noise is not None and self.noise not in levels:
            known = ", ".join(f"{level:g}" for level in levels)
            raise ValueError(f"{folder}: has no noise {self.noise:g}, only {known}")

    def takes(self, sample: dict[str, Any], pair: dict[str, Any]) -> bool:
        return (
            self.split in (None, sample["split"])
            and self.world in (None, sample["world"])
            and self.low <= pair["overlap"] <= self.high
            and self.noise in (None, sample["settings"]["noise"])
            and self.identifiable in (None, pair["identifiable"])
        )


def selected_pairs(manifest: Manifest, wanted: PairFilter) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Yield the samples and pairs that a filter selects, in order."""
    return ((sample, pair) for sample in manifest.samples for pair in sample["pairs"] if wanted.takes(sample, pair))


def pair_table(rows: Iterator[tuple[dict[str, Any], dict[str, Any]]]) -> Table:
    """Tabulate pairs, one per line, with their number below."""
    table = plain_table(
        ("sample", False),
        ("target", False),
        ("source", False),
        ("split", False),
        ("world", False),
        ("noise", True),
        ("overlap", True),
        ("residual [m]", True),
        ("one\nfit", False),
    )
    listed: Sequence[Any] = list(rows)
    for sample, pair in listed:
        residual = "-" if pair["residual_m"] is None else f"{pair['residual_m']:.3f}"
        table.add_row(
            sample["sample"],
            pair["target"],
            pair["source"],
            sample["split"],
            sample["world"],
            f"{sample['settings']['noise']:g}",
            f"{100 * pair['overlap']:.0f} %",
            residual,
            "yes" if pair["identifiable"] else "no",
        )
    table.caption = counted(len(listed), "pair")
    return table
