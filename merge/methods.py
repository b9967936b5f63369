"""The methods of proposing transforms, by name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from merge.baselines.plain_orb import PlainOrb
from merge.proposer import Proposer
from merge.published import Published
from merge.quilt import Quilt
from merge.sift import Sift

PROPOSERS: Mapping[str, Proposer[Any]] = MappingProxyType({"quilt": Quilt(), "sift": Sift(), "orb": PlainOrb()})

PUBLISHED: Mapping[str, Published[Any]] = MappingProxyType({"orb": PlainOrb()})
"""Those that come with an answer and a rule of acceptance of their own."""
