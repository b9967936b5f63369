"""Folder of disturbed pairs: maps, a list of pairs, and an overview."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import save_map
from mapping.io.transaction import atomic_folder, finish_transaction, written_files
from mapping.map_set import MapSet
from mapping.seeds import Role, stream
from mapping.wording import did_you_mean
from mapquilt.benchmark.disturbance.footprints import TrueFootprints, with_footprints
from mapquilt.benchmark.disturbance.kinds import KINDS
from mapquilt.benchmark.disturbance.overview import overview_png
from mapquilt.benchmark.disturbance.settings import DisturbanceSettings
from mapquilt.benchmark.disturbance.truth import refitted_truth
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.pair_list import PAIRS_FILE, pair_entry
from mapquilt.evaluation.evaluated_pair import GroundTruth
from mapquilt.jobs.runner import Progress, no_progress
from mapquilt.json_file import write_record
from mapquilt.runs.folder import refuse_foreign

MAPS_FOLDER, OVERVIEW_FILE = "maps", "overview.png"


@dataclass(frozen=True, eq=False)
class DisturbedPair:
    """``maps`` are target and disturbed source, ``truth`` theirs in stated metres.

    ``before`` is the source as it was, and ``before_from_source`` the motion between the true transforms.
    """

    maps: MapSet
    truth: GroundTruth
    before: OccupancyGrid
    before_from_source: Similarity2


def require_kinds(kinds: Sequence[str]) -> None:
    """Raise ``ValueError`` if a kind of disturbance is not known."""
    for kind in kinds:
        if kind not in KINDS:
            raise ValueError(f"--kind {kind}: must be one of {', '.join(KINDS)}{did_you_mean(kind, KINDS)}")


def refuse_foreign_pairs(out: Path) -> None:
    """Raise ``ValueError`` if a folder holds anything but disturbed pairs that mapquilt wrote.

    A list of pairs has no mark, and may be the user's.
    """
    if out.is_dir():
        finish_transaction(out)
        if any(out.iterdir()) and PAIRS_FILE not in written_files(out):
            raise ValueError(f"{out}: is not empty and holds no pairs that mapquilt wrote; name another folder")
    refuse_foreign(out, PAIRS_FILE)


def useful_pairs(pairs: Sequence[BenchmarkPair], low: float, high: float) -> list[BenchmarkPair]:
    """Select pairs of this overlap that have exactly one right answer and a fitted truth; where ``low`` is 0, also
    those that must be refused."""
    return [
        pair
        for pair in pairs
        if low <= (pair.truth.overlap or 0.0) <= high
        and (pair.truth.target_from_source is None or (pair.truth.identifiable and pair.truth.residual_m is not None))
    ]


def disturb_pair(kind: str, pair: BenchmarkPair, seed: int, index: int = 0) -> DisturbedPair:
    """Disturb the source of a data set's pair with the random numbers of its seed and index.

    Raises ``ValueError`` or ``OSError`` naming a bad map file.
    """
    maps = pair.maps()
    (target, source), truth = maps.grids, pair.metric_truth(maps)
    true, scale = truth.target_from_source, truth.target_scale
    settings = DisturbanceSettings().stated_at(scale if true is None else scale * true.scale)
    done = KINDS[kind](source, settings, stream(seed, Role.DISTURBANCE, index))
    now = refitted_truth(truth, target, done)
    if true is not None and done.moved is None:
        now = with_footprints(now, TrueFootprints.of(pair).after(done))
    moved = Similarity2.identity()
    if true is not None and now.target_from_source is not None:
        moved = true.inverse() @ now.target_from_source
    return DisturbedPair(replace(maps, grids=(target, done.grid)), now, source, moved)


def write_disturbed(
    pairs: Sequence[BenchmarkPair],
    kinds: Sequence[str],
    out: Path,
    seed: int,
    on_progress: Progress = no_progress,
) -> dict[str, int]:
    """Disturb each pair once, by kinds dealt evenly at random, and write the folder, all or nothing.

    Returns the number of pairs of each kind. Raises ``ValueError`` or ``OSError`` naming a bad map file.
    """
    dealt = stream(seed, Role.DISTURBANCE, 0).permutation(len(pairs)) % len(kinds)
    entries, digits = [], len(str(len(pairs)))
    shown: dict[str, DisturbedPair] = {}
    with atomic_folder(out, ledger=True) as folder:
        (folder / MAPS_FOLDER).mkdir()
        for number, (pair, which) in enumerate(zip(pairs, dealt.tolist(), strict=True), start=1):
            kind = kinds[which]
            done = disturb_pair(kind, pair, seed, number)
            stems = [f"{MAPS_FOLDER}/{number:0{digits}d}-{name}" for name in ("target", kind)]
            for stem, grid in zip(stems, done.maps.grids, strict=True):
                save_map(grid, folder / stem, picture="png")
            info = replace(pair.info, subset=kind)
            target, source = done.maps.grids
            entry = pair_entry(
                info,
                done.truth,
                frames=(target.frame, source.frame),
                resolutions_trusted=done.maps.resolutions_trusted,
                files=(f"{stems[0]}.yaml", f"{stems[1]}.yaml"),
            )
            entries.append(entry)
            shown.setdefault(kind, done)
            on_progress(number, len(pairs))
        write_record(folder / PAIRS_FILE, "pairs", {"pairs": entries})
        cards = {
            kind: (done.before, done.maps.grids[1], done.before_from_source)
            for kind, done in sorted(shown.items(), key=lambda item: kinds.index(item[0]))
        }
        (folder / OVERVIEW_FILE).write_bytes(overview_png(cards))
    return {kind: sum(entry["subset"] == kind for entry in entries) for kind in kinds}
