"""What runs in the study, and on what terms."""

from __future__ import annotations

from mapping.geometry.scale_range import ScaleRange
from merge.methods import PROPOSERS
from merge.settings import MergeSettings

AS_PUBLISHED = ("sift", "sift_orb", "morphology")
"""The thesis's own pipelines also run by themselves, as published."""

PLAIN, CORRECTED = "sift as published", "morphology as published"
"""The two pipelines that the thesis compares."""

SCALE = ScaleRange.free()
"""The thesis estimates a similarity with scale, whatever cells the maps state."""


def study_methods() -> tuple[MergeSettings, ...]:
    """The thesis's pipelines as published, then every method through the common judge."""
    published = tuple(MergeSettings(name, SCALE, as_published=True) for name in AS_PUBLISHED)
    first = [name for name in AS_PUBLISHED if name in PROPOSERS]
    rest = [name for name in PROPOSERS if name not in first]
    return published + tuple(MergeSettings(name, SCALE) for name in (*first, *rest))


def method_named(title: str) -> MergeSettings:
    """The settings whose title this is. Raises ``ValueError`` naming all of them where there is none."""
    for settings in study_methods():
        if settings.title == title:
            return settings
    raise ValueError(f"--method {title}: must be one of {', '.join(each.title for each in study_methods())}")
