"""``mapquilt locate``: find the floor plan that a map belongs to."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from mapping.geometry.scale_range import ScaleRange
from mapping.io.map_file import load_map, require_known
from mapping.wording import counted, fixed
from mapquilt.cli.exit_status import ALL_MERGED, SOME_REFUSED
from mapquilt.cli.options.files import Unknown, path, unknown_grey
from mapquilt.cli.tables import print_table, warn
from mapquilt.jobs.progress import count_progress
from mapquilt.location.locate import LocationSettings, Placement, locate
from mapquilt.location.location_file import Scan, refuse_location, write_location
from mapquilt.location.plan_picture import read_plans
from mapquilt.merging.load_maps import map_warnings
from mapquilt.viz.text_table import plain_table
from merge.settings import MergeSettings
from merge.verification.settings import AcceptanceSettings


def locate_scan(
    scan: Annotated[Path, typer.Argument(metavar="MAP", help="Map of a robot: map_server YAML, PGM or PNG.")],
    plans: Annotated[
        list[Path], typer.Argument(metavar="PLAN...", help="Pictures of drawn floor plans: PNG, JPEG, TIFF, BMP, PGM.")
    ],
    plan_resolution: Annotated[
        float | None, typer.Option(help="Resolution of the plans [m/pixel]; default: unknown, any scale is tried.")
    ] = None,
    scale: Annotated[
        str | None,
        typer.Option(
            metavar="LOW:HIGH",
            help="With --plan-resolution: metres of the plan per metre of the map, or known.",
            show_default="0.9:1.1",
        ),
    ] = None,
    min_confidence: Annotated[
        float, typer.Option(help="Least confidence of the plan named, 0 to 1.")
    ] = AcceptanceSettings.min_confidence,
    seed: Annotated[int, typer.Option(help="Seed of the method's random samples.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option(parser=path, help="Folder for location.json, location.png and the plan named as a map."),
    ] = None,
    unknown: Unknown = None,
) -> int:
    """Find the floor plan that a map belongs to, and its place there: at most one plan is named.

    Walls may be solid, hatched or two lines; text, dimensions, doors and stairs are ignored. Exit status 1 if the map
    belongs to none.

    Example: mapquilt locate scan.yaml plans/*.png --out located
    """
    settings = _settings(plan_resolution, scale, min_confidence)
    loaded = require_known(load_map(scan, unknown_grey=unknown_grey(unknown)))
    if loaded.unit == "cell" and plan_resolution is not None:
        raise ValueError(
            f"--plan-resolution {plan_resolution:g}: gives no scale, because {scan} states no resolution; name a "
            "map_server YAML, or leave the option out"
        )
    if out is not None:
        refuse_location(out, scan, plans)
    with count_progress("reading plans") as on_progress:
        pictures = read_plans(plans, on_progress)
    warn(map_warnings(scan, loaded))
    with count_progress("matching plans") as on_progress:
        found = locate(loaded.grid, pictures, settings, seed=seed, unit=loaded.unit, on_progress=on_progress)
    print_table(_table(found))
    if out is not None:
        written = write_location(out, Scan(scan, loaded.grid, loaded.unit), found, settings, seed)
        print_table(f"\n{out}: {', '.join(each.name for each in written)}")
    return ALL_MERGED if found[0].reason is None else SOME_REFUSED


def _settings(plan_resolution: float | None, scale: str | None, min_confidence: float) -> LocationSettings:
    """Return the settings of the call. Raises ``ValueError`` that names the option."""
    if plan_resolution is not None and not 0.0 < plan_resolution < float("inf"):
        raise ValueError(f"--plan-resolution {plan_resolution:g}: must be positive and finite, in metres a pixel")
    if scale is not None and plan_resolution is None:
        raise ValueError(f"--scale {scale}: needs --plan-resolution, without which any scale is tried")
    chosen = LocationSettings.scale if scale is None else ScaleRange.parse(scale)
    if chosen is None:
        raise ValueError("--scale auto: must be LOW:HIGH such as 0.9:1.1, or known")
    acceptance = dataclasses.replace(AcceptanceSettings(), min_confidence=min_confidence)
    return LocationSettings(MergeSettings(acceptance=acceptance), plan_resolution, chosen)


def _table(found: Sequence[Placement]) -> Table:
    """Tabulate the plans by confidence, with the transform of the map onto each; reasons are listed below."""
    table = plain_table(
        ("plan", False), ("verdict", False), ("confidence", True), ("yaw [rad]", True), ("scale", True), ("x, y", True)
    )
    notes = []
    for one in found:
        place = one.plan_from_scan
        shown = ("-", "-", "-")
        if place is not None:
            unit = "m" if one.unit == "m" else "pixels"
            shown = (fixed(place.yaw, 4), f"{place.scale:.4g}", f"{fixed(place.x, 2)}, {fixed(place.y, 2)} {unit}")
        table.add_row(one.plan.name, "named" if one.reason is None else "refused", f"{one.confidence:.2f}", *shown)
        if one.reason is not None:
            notes.append(f"{one.plan.name}: {one.reason}")
    best = found[0]
    if best.reason is not None:
        notes.append(f"none of {counted(len(found), 'plan')} is named")
    elif best.scan_per_pixel is not None:
        notes.append(f"the map lies on {best.plan.name}, whose pixels are {best.scan_per_pixel:.4g} m wide by the map")
    table.caption = "\n".join(notes)
    return table
