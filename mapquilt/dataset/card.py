"""Data card: README.md and histograms of a data set."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mapping.io.atomic import write_bytes_atomically
from mapping.wording import counted
from mapquilt.dataset.manifest import Manifest
from mapquilt.dataset.spec import LICENCE, DatasetSpec
from mapquilt.viz.palette import INK, ROBOTS
from mapquilt.viz.plot_style import whole_numbers
from mapquilt.viz.png import default_style, figure_png

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CARD_FILE = "README.md"
FIGURE_FILE = "figures.png"
OVERLAP_BOUNDS = (0.0, 0.05, 0.15, 0.3, 0.6, 1.0)
"""Bounds of the overlap strata; each includes its upper bound."""

TEMPLATE = """\
# {{ spec.name }}

A data set of simulated robot teams: occupancy grids, each mapped by one robot in a frame of its own, and the true
transforms between them. mapquilt made it from `spec.json` with seed {{ spec.seed }}; the same specification gives the
same bytes. Licence of the data: {{ licence }}.

{{ samples }} samples of {{ missions }} missions in {{ worlds }} different worlds; {{ maps }} maps, {{ pairs }} pairs of
maps of different robots, {{ negatives }} pairs of maps of two worlds, which a merger must refuse{% if failures %};
{{ failures }} samples failed, see `failures.jsonl`{% endif %}.

![Histograms of overlap, distortion, scale and residual](figures.png)

{% for title, rows in tables %}
| {{ title }} | pairs | identifiable |
|---|---:|---:|
{% for name, count, identifiable in rows %}
| {{ name }} | {{ count }} | {{ identifiable }} |
{% endfor %}

{% endfor %}
A pair is identifiable if no other placement of the two true footprints fits nearly as well as the true one. If it is
not identifiable, a refusal is correct. Pairs of one mission depend on each other: bootstrap over missions, not over
pairs. No world is in two splits: worlds are compared by their content.

{% if plans %}
| plan | licence | SHA-256 |
|---|---|---|
{% for plan in plans %}
| `{{ plan.file }}`, from {{ plan.name }} | {{ plan.licence }} | `{{ plan.sha256[:16] }}` |
{% endfor %}

The licence of a plan is that of the data made from it too; each mission in `manifest.jsonl` names its own.

{% endif %}
    import mapquilt
    for pair in mapquilt.load_dataset(".", split="test").pairs:
        target, source, truth = pair.target, pair.source, pair.target_from_source

Without mapquilt, with numpy and Pillow alone:

    import json, numpy as np
    from PIL import Image
    lines = [json.loads(line) for line in open("manifest.jsonl")]
    for sample in (line for line in lines if line["kind"] == "sample"):
        folder = "samples/" + sample["sample"]
        for pair in sample["pairs"]:
            target, source = (
                np.flipud(Image.open(f"{folder}/{pair[end]}/map.pgm")) for end in ("target", "source")
            )  # row 0 lowest; 0 occupied, 254 free, 205 unknown; resolution and origin are in map.yaml
            true = pair["target_from_source"]  # metres of source to metres of target
            c, s = true["scale"] * np.cos(true["yaw"]), true["scale"] * np.sin(true["yaw"])
            matrix = np.array([[c, -s, true["x"]], [s, c, true["y"]], [0, 0, 1]])
"""


def write_card(out: Path, spec: DatasetSpec, manifest: Manifest, failures: int) -> None:
    """Write README.md and figures.png of a data set."""
    import jinja2

    samples = manifest.samples
    write_bytes_atomically(out / FIGURE_FILE, figure_png(draw_figures(samples)))
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, trim_blocks=True, keep_trailing_newline=True)
    text = environment.from_string(TEMPLATE).render(
        spec=spec,
        samples=len(samples),
        missions=len(manifest.missions),
        worlds=len({mission["fingerprint"] for mission in manifest.missions}),
        maps=sum(len(sample["maps"]) for sample in samples),
        pairs=sum(len(sample["pairs"]) for sample in samples),
        negatives=len(manifest.negatives),
        failures=failures,
        licence=", ".join(sorted({mission.get("licence", LICENCE) for mission in manifest.missions})),
        plans=manifest.plans,
        tables=_tables(samples),
    )
    write_bytes_atomically(out / CARD_FILE, text.encode())


def overlap_stratum(overlap: float) -> str:
    """Name the overlap stratum of a pair, in per cent."""
    upper = next(bound for bound in OVERLAP_BOUNDS[1:] if overlap <= bound)
    lower = OVERLAP_BOUNDS[OVERLAP_BOUNDS.index(upper) - 1]
    return f"{100 * lower:.0f} to {100 * upper:.0f} %"


def _tables(samples: Sequence[dict[str, Any]]) -> list[tuple[str, list[tuple[str, int, int]]]]:
    keys: dict[str, Callable[[Any, Any], str]] = {
        "world": lambda sample, pair: sample["world"],
        "overlap": lambda sample, pair: overlap_stratum(pair["overlap"]),
        "noise": lambda sample, pair: f"{sample['settings']['noise']:g}",
        "poses": lambda sample, pair: sample["settings"]["poses"],
        "split": lambda sample, pair: sample["split"],
    }
    tables = []
    for title, key in keys.items():
        counts: Counter[str] = Counter()
        identifiable: Counter[str] = Counter()
        for sample in samples:
            for pair in sample["pairs"]:
                counts[key(sample, pair)] += 1
                identifiable[key(sample, pair)] += pair["identifiable"]
        order = sorted(counts, key=natural_order)
        tables.append((title, [(name, counts[name], identifiable[name]) for name in order]))
    return tables


def natural_order(name: str) -> tuple[float, str]:
    """Return the key that sorts names by the number that they begin with, and then as texts."""
    head = name.split(" ")[0]
    return (float(head) if head.replace(".", "", 1).isdigit() else 0.0, name)


@default_style()
def draw_figures(samples: Sequence[dict[str, Any]]) -> Figure:
    """Draw histograms of overlap, distortion, relative scale, and residual of the true transforms."""
    from matplotlib.figure import Figure

    pairs = [pair for sample in samples for pair in sample["pairs"]]
    figure = Figure(figsize=(11, 6.4), layout="constrained", dpi=110)
    axes = figure.subplots(2, 2)
    _histogram(axes[0, 0], [100 * pair["overlap"] for pair in pairs], "true overlap [%]", "pairs", (0.0, 100.0))
    maps = [one["distortion_m"] for sample in samples for one in sample["maps"]]
    _histogram(axes[0, 1], maps, "distortion of a map, RMS [m]", "maps")
    scales = [float(np.log2(pair["target_from_source"]["scale"])) for pair in pairs]
    _histogram(axes[1, 0], scales, "scale from source to target, log2", "pairs", (-1.0, 1.0))
    residuals = [pair["residual_m"] for pair in pairs if pair["residual_m"] is not None]
    _histogram(axes[1, 1], residuals, "residual of a true transform, RMS [m]", "pairs")
    return figure


def _histogram(
    axes: Axes, values: list[float], label: str, unit: str, limits: tuple[float, float] | None = None
) -> None:
    axes.hist(values, bins=24, range=limits, color=ROBOTS[0], edgecolor="white", linewidth=0.5)
    whole_numbers(axes, "y")
    axes.set_xlabel(label, color=INK)
    axes.set_ylabel(unit, color=INK)
    axes.set_title(counted(len(values), unit.removesuffix("s")), loc="left", fontsize=9, color=INK)
    axes.spines[["top", "right"]].set_visible(False)
