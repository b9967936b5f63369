"""``mapquilt lidars``: list the lidar presets."""

from __future__ import annotations

import math

from rich.table import Table

from mapquilt.cli.exit_status import ALL_MERGED
from mapquilt.cli.tables import print_table
from mapquilt.viz.text_table import plain_table
from sim.sensors.lidar_presets import PRESETS, LidarPreset
from sim.sensors.range_noise import RangeNoise


def lidar_table() -> Table:
    """Tabulate the numbers of each preset in 80 columns, with their noise at level 1 and their sources below."""
    table = plain_table(*((name, name != "lidar") for name in ("lidar", "view", "beams", "range", "rate", "mounted")))
    notes = []
    for preset in PRESETS:
        *numbers, noise, lost = lidar_row(preset)
        table.add_row(*numbers)
        notes += [f"{preset.name}: {noise}; {lost}", *(f"  {source}" for source in preset.sources)]
    table.caption = "\n".join(("noise at level 1; share of lost, short and random readings; sources:", *notes))
    return table


def lidar_row(preset: LidarPreset) -> tuple[str, ...]:
    """Format a preset's numbers: name, view, beams, range, rate, mounting, noise at level 1, lost readings."""
    lidar, noise = preset.lidar, preset.noise
    return (
        preset.name,
        f"{math.degrees(lidar.beams * lidar.angle_increment):.0f} deg",
        f"{lidar.beams}",
        f"{lidar.range_min:g} to {lidar.range_max:g} m",
        f"{lidar.rate:g} Hz",
        f"{lidar.base_from_lidar.x:g} m ahead",
        _noise_text(noise),
        ", ".join(f"{100 * rate:g} %" for rate in (noise.dropout, noise.short, noise.random)),
    )


def _noise_text(noise: RangeNoise) -> str:
    parts = [_sum_text("", noise.range_sigma, noise.range_sigma_ratio)]
    if noise.bias_sigma or noise.bias_sigma_ratio:
        parts.append(_sum_text("bias ", noise.bias_sigma, noise.bias_sigma_ratio))
    if noise.angle_sigma:
        parts.append(f"angle {math.degrees(noise.angle_sigma):.2g} deg")
    if noise.quantum:
        parts.append(f"steps {1000 * noise.quantum:g} mm")
    return ", ".join(parts)


def _sum_text(what: str, constant: float, ratio: float) -> str:
    terms = [f"{1000 * constant:.3g} mm"] if constant else []
    terms += [f"{100 * ratio:.3g} %"] if ratio else []
    return what + " + ".join(terms)


def lidars() -> int:
    """List the lidar presets, their noise, and their sources.

    Example: mapquilt lidars
    """
    print_table(lidar_table())
    return ALL_MERGED
