"""Methods of the reproduction."""

from __future__ import annotations

from mapping.geometry.scale_range import ScaleRange
from merge.methods import method_names
from merge.settings import MergeSettings

AS_PUBLISHED = ("sift", "sift_orb", "morphology")
"""Pipelines of the thesis, which also run as published."""

PLAIN, CORRECTED = "sift as published", "morphology as published"
"""The two pipelines that the thesis compares."""

SCALE = ScaleRange.free()
"""The thesis estimates a similarity with scale, whatever cells the maps state."""


def study_methods() -> tuple[MergeSettings, ...]:
    """List the pipelines of the thesis as published, then every method with the common acceptance."""
    published = tuple(MergeSettings(name, SCALE, as_published=True) for name in AS_PUBLISHED)
    first = [name for name in AS_PUBLISHED if name in method_names()]
    rest = [name for name in method_names() if name not in first]
    return published + tuple(MergeSettings(name, SCALE) for name in (*first, *rest))


def method_named(title: str) -> MergeSettings:
    """Find the settings with this title. Raises ``ValueError`` listing all titles if there is none."""
    for settings in study_methods():
        if settings.title == title:
            return settings
    raise ValueError(f"--method {title}: must be one of {', '.join(each.title for each in study_methods())}")
