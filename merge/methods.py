"""The methods of proposing transforms, by name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from merge.proposer import Proposer
from merge.quilt import Quilt
from merge.sift import Sift

PROPOSERS: Mapping[str, Proposer[Any]] = MappingProxyType({"quilt": Quilt(), "sift": Sift()})
