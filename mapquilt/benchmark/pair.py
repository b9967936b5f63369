"""A pair of maps whose transform is known, or that must be refused."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.pixel_matrix import similarity_from_pixels
from mapping.io.map_file import load_map, require_known
from mapping.map_set import MapSet
from mapquilt.evaluation.transform_error import RIGHT

TARGET, SOURCE = "target", "source"
"""What the two maps of a pair are called."""


@dataclass(frozen=True)
class BenchmarkPair:
    """What a set of pairs says of one of them.

    - ``suite``: the set that it comes from; ``subset`` a part of that, where the set has parts;
    - ``truth``: source to target, None where the pair must be refused; ``in_pixels`` says that it maps pixels, y
      down, and not metres;
    - ``overlap``: share of the smaller map; ``identifiable``: whether there is one right answer;
    - ``fitted``, ``residual``: whether the truth was fitted on walls that both saw, and what that leaves, RMS [m];
      None where the set does not say;
    - ``target_scale``: true metres per metre that the target states;
    - ``mission``: pairs of one mission are not independent; None where every pair is by itself.
    """

    suite: str
    name: str
    target_path: Path
    source_path: Path
    truth: Similarity2 | None
    in_pixels: bool = False
    subset: str | None = None
    world: str | None = None
    noise: float | None = None
    overlap: float | None = None
    identifiable: bool = True
    fitted: bool = True
    residual: float | None = None
    target_scale: float = 1.0
    resolutions_trusted: bool = True
    mission: str | None = None

    def maps(self) -> MapSet:
        """The two maps, as the merger takes them. Raises ``ValueError`` or ``OSError`` naming the file."""
        loaded = [require_known(load_map(path)) for path in (self.target_path, self.source_path)]
        return MapSet(
            (TARGET, SOURCE),
            tuple(entry.grid for entry in loaded),
            tuple(entry.unit for entry in loaded),
            resolutions_trusted=self.resolutions_trusted,
        )

    def target_from_source(self, maps: MapSet) -> Similarity2 | None:
        """The truth in metres as the maps state them."""
        if self.truth is None or not self.in_pixels:
            return self.truth
        return similarity_from_pixels(maps.grids[0].frame, self.truth.matrix(), maps.grids[1].frame)

    def bent(self, maps: MapSet) -> bool:
        """Whether the truth's own residual exceeds half the displacement that is allowed, or none could be fitted, so
        that even a perfect answer may miss."""
        allowed = RIGHT.displacement_of_diagonal * maps.grids[0].known_diagonal * self.target_scale
        return self.truth is not None and (not self.fitted or (self.residual or 0.0) > allowed / 2.0)
