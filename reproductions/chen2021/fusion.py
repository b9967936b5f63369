"""Appendix A: rules that combine the values of cells which both maps know."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from mapping.geometry.similarity2 import Similarity2
from merge.fusion import FUSIONS, fuse
from merge.verification.cell_overlap import compare_cells
from reproductions.chen2021.missions import MapPair
from worlds.raster import true_raster
from worlds.world import World


@dataclass(frozen=True)
class FusedIndex:
    """The acceptance index of a map, fused by a rule at the true place, against the true raster of the world."""

    trial: str
    seed: int
    rule: str
    index: float


def fused_indices(pair: MapPair, world: World, trial: str, seed: int) -> Iterator[FusedIndex]:
    """Fuse a pair by each rule, and compare with the world: walls in walls, and free space in free space."""
    truth = true_raster(world)
    maps = [(Similarity2.identity(), pair.first.grid), (pair.truth, pair.second.grid)]
    world_from_map = Similarity2.from_se2(pair.first.world_from_map)
    for rule in FUSIONS:
        fused = fuse(pair.first.grid.frame, maps, rule)
        corners = [Similarity2.from_se2(grid.frame.origin, grid.frame.resolution) for grid in (truth, fused)]
        index = compare_cells(truth, fused, corners[0].inverse() @ world_from_map @ corners[1]).acceptance_index
        yield FusedIndex(trial, seed, rule, index or 0.0)
