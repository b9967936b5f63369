"""ROS message types for DDS, made of their ROS definitions. Needs the extra ``[live]``.

DDS gets a type's name and fields. The content stays CDR bytes, which rosbags reads and writes by numpy: cyclonedds
itself decodes cells to Python lists, 3 s for 800,000.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from cyclonedds.idl import make_idl_struct, types
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from mapquilt.live.bag_maps import UPDATE_DEFINITION
from mapquilt.live.topics import UPDATE_TYPE

STORE = get_typestore(Stores.ROS2_HUMBLE)
STORE.register(get_types_from_msg(UPDATE_DEFINITION, UPDATE_TYPE))

_BASES: dict[str, Any] = {
    **{
        name: getattr(types, name)
        for name in ("int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64")
    },
    "float32": types.float32,
    "float64": types.float64,
    "bool": bool,
    "byte": types.uint8,
    "string": str,
}


_DDS_NAME = re.compile(r"(\w+)::msg::dds_::(\w+)_")

_LISTS: Any = types
"""Makes array and sequence types by index, which their annotations do not know."""


def dds_name(kind: str) -> str:
    """Return the name that a ROS type has in DDS: ``nav_msgs::msg::dds_::OccupancyGrid_``."""
    package, _, name = kind.split("/")
    return f"{package}::msg::dds_::{name}_"


def ros_name(kind: str) -> str:
    """Return the ROS name of a DDS type; other names stay as they are."""
    found = _DDS_NAME.fullmatch(kind)
    return kind if found is None else f"{found[1]}/msg/{found[2]}"


@cache
def idl_type(kind: str) -> Any:
    """Return the DDS type of a ROS type, such as ``nav_msgs/msg/OccupancyGrid``."""
    fields = {name: _field(one) for name, one in STORE.fielddefs[kind][1]}
    return make_idl_struct(kind.replace("/", "_"), dds_name(kind).replace("::", "."), fields)


@cache
def cdr_type(kind: str) -> Any:
    """Return the same type for a topic, whose samples hold their content as bytes, ``cdr``."""
    fields = {name: _field(one) for name, one in STORE.fielddefs[kind][1]}
    made: Any = make_idl_struct(kind.replace("/", "_"), dds_name(kind).replace("::", "."), fields, dataclassify=False)

    def deserialize(cls: Any, data: bytes, /, **options: Any) -> Any:
        sample = cls()
        sample.cdr = data
        return sample

    made.serialize = lambda self, **options: self.cdr
    made.deserialize = classmethod(deserialize)
    made.deserialize_key = classmethod(lambda cls, data, **options: None)  # of a publisher that has gone
    return made


def _field(definition: Any) -> Any:
    node, content = definition
    if node == Nodetype.NAME:
        return idl_type(content)
    if node == Nodetype.BASE:
        return _BASES[content[0]]
    if node == Nodetype.ARRAY:
        return _LISTS.array[_field(content[0]), content[1]]
    return _LISTS.sequence[_field(content[0])]
