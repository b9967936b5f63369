"""The methods of merging by name: built-in ones, and those that a user registers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from merge.literature.chen2021.morphology import Morphology
from merge.literature.chen2021.sift import Sift
from merge.literature.genetic import Genetic
from merge.literature.hough import Hough
from merge.literature.icp import Icp
from merge.literature.plain_orb import PlainOrb
from merge.literature.published import Published
from merge.literature.random_walk import RandomWalk
from merge.literature.stitching import Stitching
from merge.proposers.correlation import CorrelationSettings
from merge.proposers.landmarks import Landmarks
from merge.proposers.normal_correlation import NormalCorrelation
from merge.proposers.orb import Orb
from merge.proposers.proposer import Proposer
from merge.proposers.second_best import SECOND_BEST


@dataclass(frozen=True)
class ProposerSettings:
    """Settings of all proposers: those of ``quilt``, the search for the second best, and the methods of literature.

    The variants ``as_published`` have the values of the publication; the others are tuned for use as proposers.
    """

    orb: Orb = field(default_factory=Orb)
    landmarks: Landmarks = field(default_factory=Landmarks)
    normal_correlation: NormalCorrelation = field(default_factory=NormalCorrelation)
    second_best: CorrelationSettings = SECOND_BEST
    sift: Sift = field(default_factory=Sift)
    sift_as_published: Sift = field(default_factory=Sift.as_published)
    sift_orb: Sift = field(default_factory=lambda: Sift("orb"))
    sift_orb_as_published: Sift = field(default_factory=lambda: Sift.as_published("orb"))
    morphology: Morphology = field(default_factory=Morphology)
    plain_orb: PlainOrb = field(default_factory=PlainOrb)
    stitching: Stitching = field(default_factory=Stitching)
    hough: Hough = field(default_factory=Hough)
    random_walk: RandomWalk = field(default_factory=RandomWalk)
    genetic: Genetic = field(default_factory=Genetic)
    icp: Icp = field(default_factory=Icp)


@dataclass(frozen=True)
class Method:
    """A method: its proposers in order, of which the next is asked while no answer is certain; and, if it was published
    with an answer and an acceptance of its own, the one that gives it. A text names a field of ``ProposerSettings``.
    """

    proposers: tuple[Proposer[Any] | str, ...]
    published: Published[Any] | str | None = None


_BUILT_IN = {
    "quilt": Method(("orb", "landmarks", "normal_correlation")),
    "sift": Method(("sift",), "sift_as_published"),
    "sift_orb": Method(("sift_orb",), "sift_orb_as_published"),
    "morphology": Method(("morphology",), "morphology"),
    "orb": Method(("plain_orb",), "plain_orb"),
    "stitching": Method(("stitching",), "stitching"),
    "hough": Method(("hough",), "hough"),
    "random_walk": Method(("random_walk",), "random_walk"),
    "genetic": Method(("genetic",), "genetic"),
    "icp": Method(("icp",), "icp"),
}
_registered: dict[str, Method] = {}


def register(name: str, proposers: Sequence[Proposer[Any]], published: Published[Any] | None = None) -> None:
    """Add a method under a name, for ``MergeSettings(method=name)``.

    ``published`` is needed only for ``as_published``. Proposers must be hashable, and picklable where worker processes
    merge: the settings of a merge bring the method along. Registering a name again replaces its method.

    Raises ``ValueError`` for the name of a built-in method, or no proposer.
    """
    if name in _BUILT_IN:
        raise ValueError(f"method {name!r} is built in, choose another name")
    if not proposers:
        raise ValueError(f"method {name!r} has no proposer, must have at least one")
    _registered[name] = Method(tuple(proposers), published)


def registered(name: str) -> Method | None:
    """Return the method that a user registered under a name, if any."""
    return _registered.get(name)


def method_names() -> tuple[str, ...]:
    """List the names of all methods, built-in ones first."""
    return (*_BUILT_IN, *_registered)


def published_names() -> tuple[str, ...]:
    """List the names of the methods that have an answer of their own (``as_published``)."""
    return tuple(name for name in method_names() if _method(name).published is not None)


def proposers_of(name: str, settings: ProposerSettings) -> tuple[Proposer[Any], ...]:
    """Build the proposers of a method."""
    return tuple(getattr(settings, each) if isinstance(each, str) else each for each in _method(name).proposers)


def published_of(name: str, settings: ProposerSettings) -> Published[Any]:
    """Build a method that answers as published."""
    found = _method(name).published
    if found is None:
        raise ValueError(f"method {name!r} has no answer of its own as published")
    built: Published[Any] = getattr(settings, found) if isinstance(found, str) else found
    return built


def _method(name: str) -> Method:
    return _BUILT_IN.get(name) or _registered[name]
