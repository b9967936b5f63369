"""The maps of one team: the input of the merger, from simulation or from disk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from mapping.geometry.scale_range import ScaleRange
from mapping.grid.occupancy_grid import OccupancyGrid

Unit = Literal["m", "cell"]


@dataclass(frozen=True, eq=False)
class MapSet:
    """The grids of one team, without the truth.

    ``units`` are those of each map's coordinates: metres, or cells if no resolution is known (a bare picture has
    resolution 1). ``resolutions_trusted`` is False if stated resolutions may be wrong by a factor. ``provenance``
    describes the origin of the maps.

    Raises ``ValueError`` if there is no map, names repeat or numbers of entries differ.
    """

    names: tuple[str, ...]
    grids: tuple[OccupancyGrid, ...]
    units: tuple[Unit, ...]
    resolutions_trusted: bool = True
    provenance: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.grids:
            raise ValueError("MapSet: no map")
        if not len(self.names) == len(self.grids) == len(self.units):
            raise ValueError(
                f"MapSet: {len(self.names)} names, {len(self.grids)} grids and {len(self.units)} units do not match"
            )
        repeated = sorted({name for name in self.names if self.names.count(name) > 1})
        if repeated:
            raise ValueError(f"MapSet: more than one map is called {repeated[0]!r}")

    @property
    def metric(self) -> bool:
        """True if every map states a resolution that can be trusted."""
        return self.resolutions_trusted and all(unit == "m" for unit in self.units)

    @property
    def scale_range(self) -> ScaleRange:
        """Range of the scale of an answer: known if the maps are metric, otherwise free."""
        return ScaleRange.known() if self.metric else ScaleRange.free()

    def __len__(self) -> int:
        return len(self.grids)
