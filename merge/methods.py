"""Methods of merging: the interfaces that they implement, and their names, built-in or registered by a user."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from merge.preparation.prepared_map import PreparedMap
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal

Description = TypeVar("Description")


class Proposer(Protocol[Description]):
    """A method that describes each map once, then proposes transforms for each pair.

    Proposals may be of any number, order and quality: alignment, verification and acceptance are common to all methods.
    """

    def describe(self, prepared: PreparedMap) -> Description:
        """Compute all that the method needs of one map; called once for all pairs of the map."""
        ...

    def propose(
        self, target: Description, source: Description, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose transforms, best first, with scales [cells per cell] in the range; empty if there are none."""
        ...


class Published(Protocol[Description]):
    """A method as it was published, with its own answer and its own acceptance rule.

    The confidence is its own score, mapped to 0 to 1: it ranks answers and is no probability.
    """

    def describe(self, prepared: PreparedMap) -> Description:
        """Compute all that the method needs of one map."""
        ...

    def published(
        self, target: Description, source: Description, scale: ScaleRange, rng: np.random.Generator
    ) -> PairAnswer:
        """Return the answer of the method by itself. A rigid method uses the middle of the scale range."""
        ...


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
    "kaze_sift": Method(("kaze_sift",), "kaze_sift"),
    "scaling_icp": Method(("scaling_icp",), "scaling_icp"),
    "hough": Method(("hough",), "hough"),
    "rectangles": Method(("rectangles",), "rectangles"),
    "random_walk": Method(("random_walk",), "random_walk"),
    "genetic": Method(("genetic",), "genetic"),
    "icp": Method(("icp",), "icp"),
}
_registered: dict[str, Method] = {}


def register(name: str, proposers: Sequence[Proposer[Any]], published: Published[Any] | None = None) -> None:
    """Add a method under a name, for ``MergeSettings(method=name)``.

    ``published`` is needed only for ``as_published``. Proposers must be hashable, and picklable for worker processes,
    since the settings of a merge carry the method. Registering a name again replaces its method.

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
    return tuple(name for name in method_names() if method_named(name).published is not None)


def method_named(name: str) -> Method:
    """Return a method by its name."""
    return _BUILT_IN.get(name) or _registered[name]
