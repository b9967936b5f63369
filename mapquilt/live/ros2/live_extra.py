"""The optional package cyclonedds, and the domain that ROS names."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def live_extra() -> Iterator[None]:
    """Import what needs cyclonedds or rosbags in this block. Raises ``ImportError`` with the way to install them."""
    try:
        yield
    except ModuleNotFoundError as error:
        missing = (error.name or "").split(".")[0]
        if missing not in ("cyclonedds", "rosbags"):
            raise
        raise ImportError(f"live topics need the package {missing}: pip install mapquilt[live]") from None


def ros_domain(domain: int | None) -> int:
    """Return the DDS domain: the one given, else that of ``ROS_DOMAIN_ID``, else 0.

    Raises ``ValueError`` if the variable holds no domain.
    """
    if domain is not None:
        return domain
    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not text.isdecimal() or int(text) > 232:
        raise ValueError(f"ROS_DOMAIN_ID is {text}, must be a number from 0 to 232")
    return int(text)
