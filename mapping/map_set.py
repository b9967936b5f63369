"""The maps of one team: what goes from simulation, or from the user's disk, to the merger."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from mapping.grid.occupancy_grid import OccupancyGrid

Unit = Literal["m", "cell"]


@dataclass(frozen=True, eq=False)
class MapSet:
    """The grids of one team and what is known of them; nothing of the truth.

    ``units`` says for each map whether its coordinates are metres, or cells because no resolution is known (a bare
    picture has resolution 1). ``resolutions_trusted`` is False where stated resolutions may be wrong by a factor.
    ``provenance`` says where the maps come from.

    Raises ``ValueError`` where there is no map, names repeat or numbers of entries differ.
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

    def __len__(self) -> int:
        return len(self.grids)
