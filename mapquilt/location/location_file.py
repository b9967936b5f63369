"""Files of a search for the plan of a map: location.json, location.png, and the plan named as a map."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import map_files
from mapping.io.transaction import change_files, written_files
from mapping.map_set import Unit
from mapquilt.json_file import record_bytes, similarity_record
from mapquilt.location.locate import LocationSettings, Placement
from mapquilt.merging.merge_file import scale_text
from mapquilt.runs.folder import refuse_foreign, spare_inputs
from mapquilt.viz.location_picture import OnPlan, location_figure
from mapquilt.viz.png import figure_png
from worlds.importing.drawn_walls import plan_grid

SCHEMA = "mapquilt-location/1"
LOCATION_FILE = "location.json"
PICTURE = "location.png"
PLAN_NAME = "plan"


@dataclass(frozen=True, eq=False)
class Scan:
    """A map to locate: its file, its ``grid``, and the unit of its coordinates."""

    path: Path
    grid: OccupancyGrid
    unit: Unit


def refuse_location(out: Path, scan: Path, plans: Sequence[Path]) -> None:
    """Raise ``ValueError`` if writing to the folder would overwrite inputs, or files that mapquilt did not write."""
    spare_inputs(out, [scan, *plans])
    refuse_foreign(out, LOCATION_FILE)


def write_location(
    out: Path, scan: Scan, placements: Sequence[Placement], settings: LocationSettings, seed: int
) -> tuple[Path, ...]:
    """Write all files, or none, into a folder, which is created if it is missing; return their paths.

    The plan named is written as a map in the metres (or cells) of the scan, to merge further maps with.
    """
    path = out / LOCATION_FILE
    files = {
        path: record_bytes(path, "location", location_record(scan, placements, settings, seed)),
        out / PICTURE: figure_png(location_figure(scan.grid, _on_plans(placements), scan.unit)),
    }
    best = placements[0]
    if best.reason is None and best.scan_per_pixel is not None:
        walls, pixel = best.plan.walls, best.plan.shrunk * best.scan_per_pixel
        files |= map_files(plan_grid(walls, pixel, settings.cells_per_wall), out / PLAN_NAME)
    out.mkdir(parents=True, exist_ok=True)
    stale = {f"{PLAN_NAME}.yaml", f"{PLAN_NAME}.pgm"} & written_files(out) - {each.name for each in files}
    change_files(out, files, stale, ledger=True)
    return tuple(files)


def _on_plans(placements: Sequence[Placement]) -> list[OnPlan]:
    """Describe the placements for the picture, in the unit of the map."""
    shown = []
    for one in placements:
        place, size = one.plan_from_scan, one.scan_per_pixel
        if place is not None and size is not None:
            pose = Similarity2(place.x / place.scale, place.y / place.scale, place.yaw)
            text = f"confidence {one.confidence:.2f}" + (f", refused: {one.reason}" if one.reason else "")
            shown.append(OnPlan(one.plan.name, one.plan.grey, size, one.plan.building, pose, text, one.reason is None))
    return shown


def location_record(
    scan: Scan, placements: Sequence[Placement], settings: LocationSettings, seed: int
) -> dict[str, Any]:
    """Build the content of location.json: one entry per plan, the most confident first."""
    best = placements[0]
    known = settings.plan_resolution is not None
    return {
        "schema": SCHEMA,
        "scan": str(scan.path),
        "unit": scan.unit,
        "plan": best.plan.name if best.reason is None else None,
        "plan_resolution": settings.plan_resolution,
        "scale": scale_text(settings.scale) if known else None,
        "min_confidence": settings.merge.acceptance.min_confidence,
        "seed": seed,
        "plans": [_placement_record(placement) for placement in placements],
    }


def _placement_record(one: Placement) -> dict[str, Any]:
    transform, pixels, evidence = one.plan_from_scan, one.plan_from_scan_pixels, one.answer.evidence
    return {
        "name": one.plan.name,
        "file": str(one.plan.path),
        "confidence": one.confidence,
        "confidence_alone": one.verdict.confidence,
        "walls_confirmed": one.walls.confirmed,
        "walls_denied": one.walls.denied,
        "reason": one.reason,
        "unit": one.unit,
        "plan_from_scan": None if transform is None else similarity_record(transform),
        "plan_from_scan_pixels": None if pixels is None else pixels.tolist(),
        "scan_per_pixel": one.scan_per_pixel,
        "covariance": None if one.covariance is None else one.covariance.tolist(),
        "evidence": None if evidence is None else dataclasses.asdict(evidence),
    }
