"""Leaves of a settings tree by dotted name: list, read, parse and change them.

A tree is a frozen dataclass of frozen dataclasses. A leaf has a dotted name, such as ``mapping.resolution``; any
unambiguous ending of it is a name too. A class whose values have names of their own, such as noise components, lists
them by ``component_names``, ``component`` and ``with_component``.
"""

from __future__ import annotations

import difflib
import types
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from types import MappingProxyType
from typing import Any, Literal, Protocol, TypeVar, Union, get_args, get_origin, get_type_hints, runtime_checkable

from mapping.geometry.scale_range import ScaleRange
from mapping.numbers import parse_number, parse_range

Tree = TypeVar("Tree")
Combined = Mapping[str, Callable[[Any, str], Any]]
"""Settings that set several leaves at once, by name."""

NONE_COMBINED: Combined = MappingProxyType({})


@runtime_checkable
class HasComponents(Protocol):
    """Settings whose values have names of their own."""

    def component_names(self) -> tuple[str, ...]: ...

    def component(self, name: str) -> float | None: ...

    def with_component(self, name: str, value: float) -> Any: ...


def leaf_names(tree: Any, prefix: str = "") -> Iterator[str]:
    """Yield the dotted names of all leaves."""
    hints = get_type_hints(type(tree))
    for each in fields(tree):
        value, name = getattr(tree, each.name), f"{prefix}{each.name}"
        if is_dataclass(value) and not isinstance(value, ScaleRange):
            yield from leaf_names(value, f"{name}.")
        elif _parser(hints[each.name]) is not None:
            yield name
    if isinstance(tree, HasComponents):
        yield from (f"{prefix}{name}" for name in tree.component_names())


def leaf_name(tree: Any, name: str, combined: Combined = NONE_COMBINED) -> str:
    """Return the full name of a leaf or combined setting. Raises ``ValueError`` for an unknown or ambiguous one."""
    known = (*leaf_names(tree), *combined)
    if name in known:
        return name
    ending = [full for full in known if full.endswith(f".{name}")]
    if len(ending) == 1:
        return ending[0]
    if ending:
        raise ValueError(f"{name} is ambiguous: {', '.join(ending)}")
    names = dict.fromkeys((*known, *(full.rpartition(".")[2] for full in known)))
    close = difflib.get_close_matches(name, names, n=3)
    hint = f"; did you mean {' or '.join(close)}?" if close else ""
    raise ValueError(f"{name} is no setting{hint}")


def get_leaf(tree: Any, name: str) -> Any:
    """Return the value of a leaf by its full name; None for a component that is not set."""
    if isinstance(tree, HasComponents) and name in tree.component_names():
        return tree.component(name)
    first, _, rest = name.partition(".")
    value = getattr(tree, first)
    return get_leaf(value, rest) if rest else value


def with_leaf(tree: Tree, name: str, text: str, combined: Combined = NONE_COMBINED) -> Tree:
    """Return the tree with one leaf, or combined setting, parsed from a text.

    Raises ``ValueError`` naming the setting and the text.
    """
    full = leaf_name(tree, name, combined)
    try:
        changed: Tree = combined[full](tree, text) if full in combined else _changed(tree, full, text)
    except ValueError as error:
        raise ValueError(f"{name}={text}: {error}") from None
    return changed


def with_assignments(tree: Tree, option: str, texts: Iterable[str], combined: Combined = NONE_COMBINED) -> Tree:
    """Apply texts such as ``mapping.resolution=0.1``. Raises ``ValueError`` naming the option and the text."""
    for text in texts:
        _, value = split_assignment(tree, option, text, combined)
        try:
            tree = with_leaf(tree, text.removesuffix(f"={value}"), value, combined)
        except ValueError as error:
            raise ValueError(f"{option} {error}") from None
    return tree


def split_assignment(tree: Any, option: str, text: str, combined: Combined = NONE_COMBINED) -> tuple[str, str]:
    """Split ``NAME=VALUE`` into the full name and the value. Raises ``ValueError`` naming the option."""
    name, equals, value = text.partition("=")
    if not equals or not value:
        raise ValueError(f"{option} {text}: must be NAME=VALUE, such as mapping.resolution=0.1")
    try:
        return leaf_name(tree, name, combined), value
    except ValueError as error:
        raise ValueError(f"{option} {text}: {error}") from None


def changed_leaves(tree: Any, defaults: Any) -> dict[str, Any]:
    """Return the leaves that differ from the defaults, by full name."""
    pairs = {name: (get_leaf(tree, name), get_leaf(defaults, name)) for name in leaf_names(tree)}
    return {name: value for name, (value, default) in pairs.items() if value != default}


def _changed(tree: Any, name: str, text: str) -> Any:
    if isinstance(tree, HasComponents) and name in tree.component_names():
        return tree.with_component(name, parse_number(text))
    first, _, rest = name.partition(".")
    if rest:
        return replace(tree, **{first: _changed(getattr(tree, first), rest, text)})
    parse = _parser(get_type_hints(type(tree))[first])
    return replace(tree, **{first: parse(text) if parse is not None else text})


def _parser(hint: Any) -> Callable[[str], Any] | None:
    """Return the function that parses a value of this type, None for types that have no text."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        (other,) = (one for one in inner if one is not type(None))
        if other is ScaleRange:
            return ScaleRange.parse
        parse = _parser(other)
        return None if parse is None else lambda text: None if text == "none" else parse(text)
    if origin is Literal or hint is str:
        return str
    if origin is tuple:
        if inner == (float, float):
            return parse_range
        if inner == (float, Ellipsis):
            return lambda text: tuple(parse_number(part) for part in text.split(":"))
        return None
    return {bool: _parse_flag, int: _parse_whole, float: parse_number}.get(hint)


def _parse_flag(text: str) -> bool:
    if text not in ("true", "false"):
        raise ValueError(f"{text!r} must be true or false")
    return text == "true"


def _parse_whole(text: str) -> int:
    number = parse_number(text)
    if number != int(number):
        raise ValueError(f"{text!r} is no whole number")
    return int(number)
