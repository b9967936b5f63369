"""Shapes of records from untrusted files: which fields there must be, and of which type."""

from __future__ import annotations

from types import UnionType
from typing import Any

Shape = type | UnionType | None | list[Any] | dict[Any, Any]
"""``float`` (any number), ``str``, ``bool``, ``int`` or a union of types; ``[shape]``, a list of such;
``{str: shape}``, a record of any fields of such values; ``{"name": shape, "name?": shape}``, a record with at least
these fields, of which one with a question mark may be missing."""

_NAMES = {float: "number", int: "whole number", str: "text", bool: "true or false", dict: "record", list: "list"}


def require_shape(value: Any, shape: Shape, place: str) -> None:
    """Check a value of JSON, faster than by a schema. Raises ``ValueError`` naming place, field, value and type."""
    if isinstance(shape, list):
        _require(isinstance(value, list), value, "a list", place)
        for index, each in enumerate(value):
            require_shape(each, shape[0], f"{place}[{index}]")
    elif isinstance(shape, dict):
        _require(isinstance(value, dict), value, "a record", place)
        if str in shape:
            for name, each in value.items():
                require_shape(each, shape[str], f"{place}.{name[:80]}")
            return
        for name, inner in shape.items():
            field = name.removesuffix("?")
            if field in value:
                require_shape(value[field], inner, f"{place}: {field}")
            elif field == name:
                raise ValueError(f"{place}: the field {name} is missing")
    else:
        _require(_is_of(value, shape), value, _title(shape), place)


def _require(holds: bool, value: Any, rule: str, place: str) -> None:
    if not holds:
        raise ValueError(f"{place} is {str(value)[:80]!r}, must be {rule}")


def _is_of(value: Any, shape: Any) -> bool:
    if isinstance(shape, UnionType):
        return any(_is_of(value, each) for each in shape.__args__)
    if shape in (int, float) and isinstance(value, bool):
        return False
    return isinstance(value, int | float if shape is float else shape)


def _title(shape: Any) -> str:
    if isinstance(shape, UnionType):
        return " or ".join(_title(each) for each in shape.__args__)
    return _NAMES.get(shape, "null")
