"""Sizes of the disturbances."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class DisturbanceSettings:
    """Ranges that a disturbance is drawn from, lowest and highest. They span what hand-held and old maps show; none is
    fitted to a set of real maps.

    - ``warp_reach``: correlation length of a warp [diagonals of the map]: one bend of the whole map, or several;
    - ``speck_share``: share of the known cells that specks turn over;
    - ``thicker_cells``: cells that walls grow by on each side;
    - ``kept_share``: share of the known cells that cropping keeps;
    - ``gap_share``: share of the known cells that gaps take; ``gap_reach``: size of a gap [diagonals of the map];
    - ``boxes``: pieces of furniture; ``box_side``: their sides [m of the world].
    """

    warp_reach: tuple[float, float] = (0.25, 0.6)
    speck_share: float = 0.004
    thicker_cells: tuple[int, int] = (1, 2)
    kept_share: tuple[float, float] = (0.55, 0.85)
    gap_share: tuple[float, float] = (0.2, 0.5)
    gap_reach: float = 0.12
    boxes: tuple[int, int] = (5, 45)
    box_side: tuple[float, float] = (0.3, 1.4)

    def stated_at(self, scale: float) -> DisturbanceSettings:
        """Convert lengths to metres as a map states them, of ``scale`` true metres each."""
        return replace(self, box_side=(self.box_side[0] / scale, self.box_side[1] / scale))
