"""Priors and settings of the merge that an arrangement asks for, and the command that repeats it."""

from __future__ import annotations

import dataclasses
import shlex
from collections.abc import Sequence

from mapping.io.map_file import UnknownGrey
from mapping.map_set import MapSet
from mapping.wording import fixed
from mapquilt.align.arrangement import PINNED, Arrangement
from mapquilt.align.snap import SnapSettings
from mapquilt.leaves import changed_leaves
from mapquilt.merging.merge_again import setting_text
from mapquilt.merging.merge_file import MergeTree, scale_text
from merge.records.prior import SIGMA, Prior
from merge.settings import MergeSettings


def arranged_settings(
    settings: MergeSettings, arrangement: Arrangement, maps: MapSet, *, trusted: bool = False
) -> MergeSettings:
    """Return the settings of a merge with each placement that a person decided as a prior, in the reference's frame.

    Numbers are rounded as the command line has them. With ``trusted``, all maps are stitched where they lie.

    Raises ``ValueError`` naming a map that cannot be stitched: nobody placed it, or its scale is not 1.
    """
    reference = arrangement.reference
    hand = SnapSettings()
    sigma = hand.sigma if maps.units[reference] == "m" else hand.sigma_cells
    priors = []
    for index, (name, placement) in enumerate(zip(maps.names, arrangement.placements, strict=True)):
        if index == reference or not (trusted or placement.decided_by in PINNED):
            continue
        pose = arrangement.target_from_source(reference, index)
        if trusted and placement.decided_by == "start":
            raise ValueError(f"{name}: has not been placed; move it, or save the merge instead")
        if trusted and abs(pose.scale - 1.0) > 1e-9:
            raise ValueError(f"{name}: scale is {pose.scale:.6g}, must be 1 to stay as placed; save the merge instead")
        x, y = map(float, _position(pose.x, pose.y))
        priors.append(Prior(name, x, y, float(_angle(pose.yaw)), sigma))
    return dataclasses.replace(
        settings, reference=maps.names[reference], priors=tuple(priors), trust_priors=trusted and len(maps) > 1
    )


def _position(x: float, y: float) -> tuple[str, str]:
    return fixed(x, 3), fixed(y, 3)


def _angle(yaw: float) -> str:
    return fixed(yaw, 5)


def repeat_command(
    sources: Sequence[str], settings: MergeSettings, seed: int, unknown: UnknownGrey, out: str | None
) -> str:
    """Write the ``mapquilt merge`` command that gives the same files; ``out`` is None for a run, which needs none."""
    plain = dataclasses.replace(settings, reference=None, priors=(), trust_priors=False, scale=None)
    words = ["mapquilt", "merge", *sources]
    if settings.scale is not None:
        words.append(f"--scale={scale_text(settings.scale)}")
    changed = changed_leaves(MergeTree(plain), MergeTree())
    words += [f"--set={name}={setting_text(value)}" for name, value in changed.items()]
    words += [f"--seed={seed}"] if seed else []
    words += [f"--unknown={unknown}"] if unknown is not None else []
    if settings.reference is not None:
        words.append(f"--reference={settings.reference}")
    words += [f"--prior={_prior_text(prior)}" for prior in settings.priors]
    words += ["--trust-priors"] if settings.trust_priors else []
    words += [] if out is None else ["--out", out]
    return shlex.join(words)


def _prior_text(prior: Prior) -> str:
    sigma = "" if prior.sigma == SIGMA else f",{prior.sigma:g}"
    return f"{prior.name}:{','.join(_position(prior.x, prior.y))},{_angle(prior.yaw)}{sigma}"
