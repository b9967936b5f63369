"""Settings of the preparation of a map."""

from __future__ import annotations

from dataclasses import dataclass

from mapping.validation import require_valid


@dataclass(frozen=True)
class PreparationSettings:
    """Settings of the preparation of a map.

    - ``border_cells``: unknown cells around the known part, so that features at its rim are found whatever the size of
      the image;
    - ``max_cells``: a larger map is compared in wider cells, which bounds time and memory; 1,000 cells a side are
      enough to tell places apart;
    - ``normal_blur_cells``: standard deviation of the Gaussian whose gradient gives the wall normals; less makes the
      steps of slanted walls normals of their own;
    - ``min_gradient``: a wall whose blurred free space has less gradient [1/cell] has no normal; a straight wall has
      0.2 to 0.3;
    - ``sector_cosine``: a wall faces right, up, left or down if its normal is within the angle of this cosine; 67
      degrees, so that a slanted wall faces two of them;
    - ``look_up_share`` [of the diagonal]: the rasters for look-ups reach so far beyond the map, so that walls just
      outside find their nearest;
    - ``behind_walls``: value of the free-space raster behind a wall, against 1 for free and 0 for unknown: a wall is a
      higher step than the end of sight;
    - ``band_share`` [of the diagonal]: the raster has that value so far behind the walls;
    - ``deep_share`` [of the diagonal]: free space is deep if nothing else is so near;
    - ``coarsest_cells``: the pyramid of rasters ends at this side;
    - ``cached_maps``: prepared maps that a cache holds; the features of a map of 400 x 400 cells take about 8 MB.
    """

    border_cells: int = 32
    max_cells: int = 2**21
    normal_blur_cells: float = 1.2
    min_gradient: float = 0.02
    sector_cosine: float = 0.38
    look_up_share: float = 0.06
    behind_walls: float = -0.5
    band_share: float = 0.02
    deep_share: float = 0.014
    coarsest_cells: int = 48
    cached_maps: int = 40

    def __post_init__(self) -> None:
        require_valid(self, not_negative=("border_cells",), signed=("behind_walls",))
