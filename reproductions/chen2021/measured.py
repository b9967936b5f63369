"""Results of the thesis's own scripts on its author's maps (Chen 2021; within 10 px, 5 degrees, 5 %)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Measured:
    """Results of one case: right runs of the existing pipeline, ``plain`` of ``plain_runs``, and its acceptance index;
    the same for the corrected pipeline, None where it was not run; and the index at the true transform."""

    plain: int
    plain_index: float
    corrected: int | None
    true_index: float
    plain_runs: int = 20
    corrected_runs: int = 5

    @property
    def plain_text(self) -> str:
        return f"{self.plain} of {self.plain_runs}"

    @property
    def corrected_text(self) -> str:
        return "not run" if self.corrected is None else f"{self.corrected} of {self.corrected_runs}"
