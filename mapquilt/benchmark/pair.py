"""A pair of map files whose transform is known, or that must be refused."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.pixel_matrix import similarity_from_pixels
from mapping.io.map_file import load_map, require_known
from mapping.map_set import MapSet
from mapquilt.dataset.loader import check_files
from mapquilt.evaluation.evaluated_pair import GroundTruth, PairInfo


@dataclass(frozen=True)
class BenchmarkPair:
    """Two map files with their truth. ``in_pixels``: the true transform maps pixels, y down, and not metres;
    ``digests``: hashes of the files that a data set's manifest states."""

    info: PairInfo
    target_file: Path
    source_file: Path
    truth: GroundTruth
    in_pixels: bool = False
    resolutions_trusted: bool = True
    digests: Mapping[Path, str] = field(default_factory=dict, repr=False)

    def maps(self) -> MapSet:
        """Load the two maps for the merger. Raises ``ValueError`` or ``OSError`` naming the file, also if it is not as
        the data set was made."""
        check_files(self.digests)
        loaded = [require_known(load_map(path)) for path in (self.target_file, self.source_file)]
        return MapSet(
            ("target", "source"),
            tuple(entry.grid for entry in loaded),
            tuple(entry.unit for entry in loaded),
            resolutions_trusted=self.resolutions_trusted,
        )

    def metric_truth(self, maps: MapSet) -> GroundTruth:
        """Return the truth in metres as the maps state them."""
        transform = self.truth.target_from_source
        if transform is None or not self.in_pixels:
            return self.truth
        metric: Similarity2 = similarity_from_pixels(maps.grids[0].frame, transform.matrix(), maps.grids[1].frame)
        return dataclasses.replace(self.truth, target_from_source=metric)
