"""The optional package rosbags."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def rosbags_extra() -> Iterator[None]:
    """Import what needs rosbags in this block. Raises ``ImportError`` with the way to install it if it is missing."""
    try:
        yield
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] != "rosbags":
            raise
        raise ImportError("a ROS bag needs the package rosbags: pip install mapquilt[ros]") from None
